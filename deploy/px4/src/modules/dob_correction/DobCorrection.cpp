// SPDX-License-Identifier: Apache-2.0

#include "DobCorrection.hpp"

#include <cstring>

#include <parameters/param.h>
#include <px4_platform_common/log.h>
#include <px4_platform_common/module.h>
#include <systemlib/mavlink_log.h>

using namespace time_literals;

static constexpr hrt_abstime SAY_EVERY = 1_s;            // at most one text in this time
static constexpr hrt_abstime MANUAL_TIMEOUT = 500_ms;    // older stick positions say nothing about the switch
static constexpr hrt_abstime ALLOCATOR_TIMEOUT = 20_ms;  // an older word of the allocator about saturation is not used
static constexpr float SWITCHED_ON = 0.5f;
static constexpr int32_t MULTIROTOR = 0;                 // CA_AIRFRAME
static constexpr const char *READY = "ready";

// Before July 2023 PX4 has no such flag: its allocator works whenever rates are controlled.
template<typename Mode>
static auto allocates(const Mode &mode, int) -> decltype(static_cast<bool>(mode.flag_control_allocation_enabled))
{
	return mode.flag_control_allocation_enabled;
}

template<typename Mode>
static bool allocates(const Mode &, long)
{
	return true;
}

DobCorrection::DobCorrection() :
	ModuleParams(nullptr),
	WorkItem("dob_correction", px4::wq_configurations::rate_ctrl)
{
	std::strncpy(_report.name, "DOB_ACT", sizeof(_report.name) - 1);
}

const char *DobCorrection::unfit()
{
	int32_t enabled = 0;
	int32_t airframe = -1;
	param_get(param_find("DOBC_EN"), &enabled);
	param_get(param_find("CA_AIRFRAME"), &airframe);

	if (enabled != 1) {
		return "DOBC_EN is 0, stock wiring";
	}

	return airframe == MULTIROTOR ? nullptr : "CA_AIRFRAME is not a multirotor, stock wiring";
}

bool DobCorrection::init()
{
	updateParams();
	look();
	return _torque_sub.registerCallback() && _reports_sub.registerCallback();
}

void DobCorrection::stop()
{
	_torque_sub.unregisterCallback();
	_reports_sub.unregisterCallback();
}

void DobCorrection::Run()
{
	keep_report();
	vehicle_torque_setpoint_s torque;

	if (!_torque_sub.update(&torque)) {
		return;
	}

	vehicle_thrust_setpoint_s thrust{};
	_thrust_sub.copy(&thrust);

	const hrt_abstime now = hrt_absolute_time();
	look();
	hear(now);

	const char *why = barred();
	const float limit[3] {_limit.get(), _limit.get(), _limit_yaw.get()};
	float added[3];
	_correction.step(now, why == nullptr, -thrust.xyz[2], limit, added);

	pass_on(torque, thrust, added);
	report(torque, thrust, added);

	say(why ? why : (_correction.fresh(now) ? READY : "no companion"), now);
}

// What comes in as DEBUG_FLOAT_ARRAY from elsewhere, the companion's own telemetry too, goes into the topic of our
// reports, which holds one message: ours is put back before it would be missed.
void DobCorrection::keep_report()
{
	debug_array_s newest;

	if (_reports_sub.update(&newest) && _published != 0
	    && std::strncmp(newest.name, _report.name, sizeof(newest.name)) != 0) {
		_report_pub.publish(_report);
	}
}

void DobCorrection::hear(hrt_abstime now)
{
	mavlink_tunnel_s tunnel;

	if (_tunnel_sub.update(&tunnel) && tunnel.payload_type == dob::CORRECTION_TYPE
	    && tunnel.target_system == _status.system_id && tunnel.target_component == _status.component_id) {
		_taken[static_cast<int>(_correction.take(tunnel.payload, tunnel.payload_length, now))]++;
	}
}

void DobCorrection::look()
{
	if (_parameter_sub.updated()) {
		parameter_update_s update;
		_parameter_sub.copy(&update);
		updateParams();
	}

	_status_sub.update(&_status);
	_landed_sub.update(&_landed);
	_mode_sub.update(&_mode);
	_manual_sub.update(&_manual);
	_allocator_sub.update(&_allocator);
}

const char *DobCorrection::barred() const
{
	if (!_enabled.get()) {
		return "off by DOBC_EN";

	} else if (_foreign) {
		return "another torque setpoint, nothing added";

	} else if (!dob::Correction::valid_limit(_limit.get())) {
		return "DOBC_LIMIT not in 0..0.5";

	} else if (!dob::Correction::valid_limit(_limit_yaw.get())) {
		return "DOBC_LIMIT_Y not in 0..0.5";

	} else if (_aux.get() < 0 || _aux.get() > 6) {
		return "DOBC_AUX not in 0..6";

	} else if (switched_off()) {
		return "off by switch";

	} else if (_allocator.handled_motor_failure_mask != 0) {
		return "motor failure";

	} else if (!in_hover()) {
		return "not in hover";
	}

	return nullptr;
}

bool DobCorrection::in_hover() const
{
	return armed() && !_landed.landed && _mode.flag_control_rates_enabled && allocates(_mode, 0)
	       && _status.nav_state != vehicle_status_s::NAVIGATION_STATE_TERMINATION
	       && _status.vehicle_type == vehicle_status_s::VEHICLE_TYPE_ROTARY_WING && !_status.is_vtol
	       && !_status.in_transition_mode;
}

bool DobCorrection::switched_off() const
{
	if (_aux.get() == 0) {
		return false;
	}

	const float aux[6] {_manual.aux1, _manual.aux2, _manual.aux3, _manual.aux4, _manual.aux5, _manual.aux6};
	return !_manual.valid || hrt_elapsed_time(&_manual.timestamp) > MANUAL_TIMEOUT
	       || !(aux[_aux.get() - 1] > SWITCHED_ON);
}

void DobCorrection::pass_on(vehicle_torque_setpoint_s &torque, const vehicle_thrust_setpoint_s &thrust,
			    const float added[3])
{
	vehicle_torque_setpoint_s acting;

	if (_acting_sub.update(&acting) && acting.timestamp != _published) {
		_foreign = true;
	}

	for (int axis = 0; axis < 3; axis++) {
		if (added[axis] < 0.f || added[axis] > 0.f) {
			torque.xyz[axis] += added[axis];
		}
	}

	// thrust first: the allocator runs on the torque
	_thrust_pub.publish(thrust);
	torque.timestamp = hrt_absolute_time();
	_published = torque.timestamp;
	_torque_pub.publish(torque);
}

void DobCorrection::report(const vehicle_torque_setpoint_s &torque, const vehicle_thrust_setpoint_s &thrust,
			   const float added[3])
{
	const bool told = hrt_elapsed_time(&_allocator.timestamp) < ALLOCATOR_TIMEOUT && !_allocator.torque_setpoint_achieved;

	for (int axis = 0; axis < 3; axis++) {
		const float moment = torque.xyz[axis] - (told ? _allocator.unallocated_torque[axis] : 0.f);
		_report.data[axis] = std::fmax(-1.f, std::fmin(1.f, moment));
		_report.data[4 + axis] = added[axis];
	}

	_report.data[3] = -thrust.xyz[2];
	_report.data[7] = _correction.age_us(torque.timestamp);
	_report.timestamp = torque.timestamp;
	_report_pub.publish(_report);
}

void DobCorrection::say(const char *why, hrt_abstime now)
{
	if (why != _said && now - _said_at >= SAY_EVERY) {
		_said = why;
		_said_at = now;
		mavlink_log_info(&_text_pub, "DOBC: %s", why);
	}
}

void DobCorrection::print_status() const
{
	PX4_INFO("%s", _said);
	PX4_INFO("corrections taken up %u, malformed %u, out of order %u, too old or of another clock %u",
		 (unsigned)_taken[0], (unsigned)_taken[1], (unsigned)_taken[2], (unsigned)_taken[3]);
	PX4_INFO("moment %.4f %.4f %.4f, of it added %.4f %.4f %.4f, age %.0f us", (double)_report.data[0],
		 (double)_report.data[1], (double)_report.data[2], (double)_report.data[4], (double)_report.data[5],
		 (double)_report.data[6], (double)_report.data[7]);
}

static DobCorrection *running{nullptr};

static int start()
{
	if (running) {
		PX4_ERR("already running");
		return 1;
	}

	const char *unfit = DobCorrection::unfit();

	if (unfit) {
		orb_advert_t text{nullptr};
		mavlink_log_info(&text, "DOBC: %s", unfit);
		return 1;
	}

	running = new DobCorrection();

	if (!running || !running->init()) {
		PX4_ERR("cannot start");
		delete running;
		running = nullptr;
		return 1;
	}

	return 0;
}

static int stop()
{
	if (running && running->armed()) {
		PX4_ERR("armed: the motors hang on it");
		return 1;
	}

	if (running) {
		running->stop();
		delete running;
		running = nullptr;
		PX4_WARN("now: mc_rate_control stop, mc_rate_control start");
	}

	return 0;
}

extern "C" __EXPORT int dob_correction_main(int argc, char *argv[])
{
	if (argc == 2 && std::strcmp(argv[1], "start") == 0) {
		return start();

	} else if (argc == 2 && std::strcmp(argv[1], "stop") == 0) {
		return stop();

	} else if (argc == 2 && std::strcmp(argv[1], "status") == 0) {
		if (running) {
			running->print_status();

		} else {
			PX4_INFO("not running");
		}

		return 0;
	}

	PX4_INFO("usage: dob_correction start|stop|status (docs/px4.md)");
	return 1;
}
