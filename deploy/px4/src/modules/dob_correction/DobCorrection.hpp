// SPDX-License-Identifier: Apache-2.0
//
// Adds a dob-companion's torque correction between PX4's rate controller and its control allocator; docs/px4.md.
//
//   mc_rate_control (started as `vtol`) ──► vehicle_torque_setpoint_virtual_mc ──► this module
//   this module ──► vehicle_torque_setpoint ──► control_allocator
//
// All three run one after the other on the same work queue, so the allocator sees each setpoint once, with the correction
// in it. With no correction the setpoint is passed on bit for bit.
//
// In:  TUNNEL of type 53425 (Correction.hpp), which PX4 publishes as mavlink_tunnel.
// Out: debug_array "DOB_ACT", which PX4 streams as DEBUG_FLOAT_ARRAY: its stamp is the time from which the moment acts,
//      [0..2] the moment at the motors, correction included, [3] thrust, [4..6] the correction in it, [7] its age, µs;
//      -1: none.

#pragma once

#include "Correction.hpp"

#include <drivers/drv_hrt.h>
#include <px4_platform_common/module_params.h>
#include <px4_platform_common/px4_work_queue/WorkItem.hpp>
#include <uORB/Publication.hpp>
#include <uORB/Subscription.hpp>
#include <uORB/SubscriptionCallback.hpp>
#include <uORB/topics/control_allocator_status.h>
#include <uORB/topics/debug_array.h>
#include <uORB/topics/manual_control_setpoint.h>
#include <uORB/topics/mavlink_tunnel.h>
#include <uORB/topics/parameter_update.h>
#include <uORB/topics/vehicle_control_mode.h>
#include <uORB/topics/vehicle_land_detected.h>
#include <uORB/topics/vehicle_status.h>
#include <uORB/topics/vehicle_thrust_setpoint.h>
#include <uORB/topics/vehicle_torque_setpoint.h>

class DobCorrection : public ModuleParams, public px4::WorkItem
{
public:
	DobCorrection();

	// What speaks against this aircraft; nullptr: nothing. Then `init` has begun to work.
	static const char *unfit();
	bool init();

	bool armed() const { return _status.arming_state == vehicle_status_s::ARMING_STATE_ARMED; }
	void stop();
	void print_status() const;

private:
	void Run() override;
	void keep_report();
	void hear(hrt_abstime now);
	void look();
	const char *barred() const;
	bool in_hover() const;
	bool switched_off() const;
	void pass_on(vehicle_torque_setpoint_s &torque, const vehicle_thrust_setpoint_s &thrust, const float added[3]);
	void report(const vehicle_torque_setpoint_s &torque, const vehicle_thrust_setpoint_s &thrust, const float added[3]);
	void say(const char *why, hrt_abstime now);

	uORB::SubscriptionCallbackWorkItem _torque_sub{this, ORB_ID(vehicle_torque_setpoint_virtual_mc)};
	uORB::SubscriptionCallbackWorkItem _reports_sub{this, ORB_ID(debug_array)};
	uORB::Subscription _thrust_sub{ORB_ID(vehicle_thrust_setpoint_virtual_mc)};
	uORB::Subscription _acting_sub{ORB_ID(vehicle_torque_setpoint)};
	uORB::Subscription _tunnel_sub{ORB_ID(mavlink_tunnel)};
	uORB::Subscription _allocator_sub{ORB_ID(control_allocator_status)};
	uORB::Subscription _manual_sub{ORB_ID(manual_control_setpoint)};
	uORB::Subscription _mode_sub{ORB_ID(vehicle_control_mode)};
	uORB::Subscription _landed_sub{ORB_ID(vehicle_land_detected)};
	uORB::Subscription _status_sub{ORB_ID(vehicle_status)};
	uORB::Subscription _parameter_sub{ORB_ID(parameter_update)};

	uORB::Publication<vehicle_torque_setpoint_s> _torque_pub{ORB_ID(vehicle_torque_setpoint)};
	uORB::Publication<vehicle_thrust_setpoint_s> _thrust_pub{ORB_ID(vehicle_thrust_setpoint)};
	uORB::Publication<debug_array_s> _report_pub{ORB_ID(debug_array)};
	orb_advert_t _text_pub{nullptr};

	dob::Correction _correction;
	control_allocator_status_s _allocator{};
	manual_control_setpoint_s _manual{};
	vehicle_control_mode_s _mode{};
	vehicle_land_detected_s _landed{};
	vehicle_status_s _status{};
	debug_array_s _report{};

	hrt_abstime _published{0};    // stamp of the newest torque setpoint of ours
	bool _foreign{false};         // somebody else publishes the torque setpoint as well
	const char *_said{""};
	hrt_abstime _said_at{0};
	uint32_t _taken[4] {};        // how many messages ended how, by dob::Taken

	DEFINE_PARAMETERS(
		(ParamBool<px4::params::DOBC_EN>) _enabled,
		(ParamFloat<px4::params::DOBC_LIMIT>) _limit,
		(ParamFloat<px4::params::DOBC_LIMIT_Y>) _limit_yaw,
		(ParamInt<px4::params::DOBC_AUX>) _aux
	)
};
