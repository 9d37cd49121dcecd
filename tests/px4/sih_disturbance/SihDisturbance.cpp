// SPDX-License-Identifier: Apache-2.0
//
// A disturbance for PX4's simulated quadrotor (SIH), for tests only. It takes the place of pwm_out_sim, which must have no
// motors (PWM_MAIN_FUNC1 to 4: 0): motor commands go
// to the simulator as they come from the control allocator, plus what a DEBUG_VECT "DOB_DIST" asks for: x, y, z = roll,
// pitch, yaw, each as the share of full throttle by which every motor is moved in the sense of that axis.
//
// The simulator waits for motor commands after each of its steps. Where none come for 20 ms of wall time, while the rate
// controller is restarted, all motors off is sent, or its clock would stand still.

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>

#include <drivers/drv_hrt.h>
#include <px4_platform_common/log.h>
#include <px4_platform_common/module.h>
#include <px4_platform_common/px4_work_queue/WorkItem.hpp>
#include <uORB/Publication.hpp>
#include <uORB/Subscription.hpp>
#include <uORB/SubscriptionCallback.hpp>
#include <uORB/topics/actuator_armed.h>
#include <uORB/topics/actuator_motors.h>
#include <uORB/topics/actuator_outputs.h>
#include <uORB/topics/debug_vect.h>

static constexpr int MOTORS = 4;
// Senses of the simulator's quadrotor, motor by motor: roll, pitch, yaw.
static constexpr float SENSE[MOTORS][3] = {{-1, 1, 1}, {1, -1, 1}, {1, 1, -1}, {-1, -1, -1}};

class SihDisturbance : public px4::WorkItem
{
public:
	SihDisturbance() : WorkItem("sih_disturbance", px4::wq_configurations::rate_ctrl) {}

	bool init()
	{
		std::thread(&SihDisturbance::keep_going, this).detach();
		return _motors_sub.registerCallback();
	}

private:
	void Run() override
	{
		debug_vect_s wish;

		if (_wish_sub.update(&wish) && std::strncmp(wish.name, "DOB_DIST", sizeof(wish.name)) == 0) {
			_disturbance[0] = wish.x;
			_disturbance[1] = wish.y;
			_disturbance[2] = wish.z;
		}

		_armed_sub.update(&_armed);

		actuator_motors_s motors;

		if (!_motors_sub.update(&motors)) {
			return;
		}

		actuator_outputs_s out{};
		out.noutputs = 16;

		for (int i = 0; i < MOTORS; i++) {
			if (_armed.armed && std::isfinite(motors.control[i])) {
				float u = motors.control[i];

				if (u > 0.05f) { // not on the ground

					for (int axis = 0; axis < 3; axis++) {
						u += SENSE[i][axis] * _disturbance[axis];
					}
				}

				out.output[i] = std::fmin(1.f, std::fmax(0.f, u));
			}
		}

		out.timestamp = hrt_absolute_time();
		_outputs_pub.publish(out);
		_count++;
	}

	void keep_going()
	{
		uORB::Publication<actuator_outputs_s> outputs_pub{ORB_ID(actuator_outputs_sim)};
		unsigned last = 0;

		while (true) {
			std::this_thread::sleep_for(std::chrono::milliseconds(20));
			const unsigned count = _count;

			if (count == last) {
				actuator_outputs_s none{};
				none.timestamp = hrt_absolute_time();
				outputs_pub.publish(none);
			}

			last = count;
		}
	}

	uORB::SubscriptionCallbackWorkItem _motors_sub{this, ORB_ID(actuator_motors)};
	uORB::Subscription _wish_sub{ORB_ID(debug_vect)};
	uORB::Subscription _armed_sub{ORB_ID(actuator_armed)};
	uORB::Publication<actuator_outputs_s> _outputs_pub{ORB_ID(actuator_outputs_sim)};

	actuator_armed_s _armed{};
	std::atomic<unsigned> _count{0};
	float _disturbance[3] {};
};

extern "C" __EXPORT int sih_disturbance_main(int argc, char *argv[])
{
	static SihDisturbance *running = nullptr;

	if (argc != 2 || std::strcmp(argv[1], "start") != 0 || running != nullptr) {
		PX4_ERR("usage: sih_disturbance start, once");
		return 1;
	}

	running = new SihDisturbance();
	return running->init() ? 0 : 1;
}
