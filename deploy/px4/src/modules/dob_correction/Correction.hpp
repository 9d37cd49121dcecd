// SPDX-License-Identifier: Apache-2.0
//
// What is added to the torque setpoint and when: plain C++14 without a line of PX4, so that it can be tested anywhere.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace dob
{

// The payload of the TUNNEL that carries a correction, little-endian: stamp of the gyro sample that it answers (uint64, µs
// of the vehicle's clock), then roll, pitch and yaw moment to add (float, normalized torque).
static constexpr uint16_t CORRECTION_TYPE = 53425;      // of TUNNEL's payload; above 32767: free for private use
static constexpr uint8_t CORRECTION_SIZE = 20;

static constexpr float HOLD_S = 0.1f;         // without news for so long the last correction still acts
static constexpr float FADE_OUT_S = 0.1f;     // then it goes to zero within this time; so it does when the pilot says so
static constexpr float FADE_IN_S = 0.5f;      // and comes back no faster than this
static constexpr float LIMIT_PER_S = 0.2f;    // a changed limit is moved to at this rate
static constexpr float LARGEST_LIMIT = 0.5f;
static constexpr float LEAST_THRUST = 0.05f;  // nothing is added below this thrust,
static constexpr float FULL_THRUST = 0.10f;   // and all of it from this one on
static constexpr uint64_t OLD_US = 100000;    // a correction that answers an older sample than this is not taken up
static constexpr uint64_t FORGET_US = 5000000; // after so long the order of stamps is not held on to: a clock that jumped

enum class Taken { Yes, Malformed, OutOfOrder, OutOfTime };

class Correction
{
public:
	// A payload that has come in at `now`, µs. Anything but `Yes` leaves everything as it was.
	Taken take(const uint8_t *payload, uint8_t size, uint64_t now)
	{
		if (size != CORRECTION_SIZE) {
			return Taken::Malformed;
		}

		uint64_t stamp;
		float moment[3];
		std::memcpy(&stamp, payload, sizeof(stamp));
		std::memcpy(moment, payload + sizeof(stamp), sizeof(moment));

		for (float axis : moment) {
			if (!(axis >= -1.f && axis <= 1.f)) { // so is what is not a number
				return Taken::Malformed;
			}
		}

		if (_heard && stamp <= _stamp && now - _received < FORGET_US) {
			return Taken::OutOfOrder;
		}

		if (stamp > now || now - stamp > OLD_US) {
			return Taken::OutOfTime;
		}

		_heard = true;
		_stamp = stamp;
		_received = now;
		std::memcpy(_asked, moment, sizeof(_asked));
		return Taken::Yes;
	}

	// One cycle of the rate controller at `now`, µs. `let_in`: nothing speaks against a correction but a missing one.
	// `thrust`: 0..1, `limit`: per axis as set. Fills in what is to be added, per axis.
	void step(uint64_t now, bool let_in, float thrust, const float limit[3], float added[3])
	{
		const float passed = _stepped ? seconds(now, _last_step) : 0.f;
		move_gate(passed, let_in && fresh(now));
		const float share = _gate * ramp(thrust);

		for (int axis = 0; axis < 3; axis++) {
			move_limit(_limit[axis], limit[axis], passed);
			added[axis] = share > 0.f ? share * clip(_asked[axis], _limit[axis]) : 0.f;
		}

		_last_step = now;
		_stepped = true;
	}

	// Whether a correction is there that still holds.
	bool fresh(uint64_t now) const { return _heard && seconds(now, _received) <= HOLD_S; }

	// Time from the gyro sample to `now`, µs; -1: nothing of it acts any more.
	float age_us(uint64_t now) const
	{
		return _heard && seconds(now, _received) <= HOLD_S + FADE_OUT_S ? static_cast<float>(now - _stamp) : -1.f;
	}

	static bool valid_limit(float limit) { return limit >= 0.f && limit <= LARGEST_LIMIT; }

private:
	static float seconds(uint64_t now, uint64_t then) { return now > then ? 1e-6f * static_cast<float>(now - then) : 0.f; }

	static float clip(float value, float limit) { return std::max(-limit, std::min(limit, value)); }

	static float ramp(float thrust)
	{
		const float share = (thrust - LEAST_THRUST) / (FULL_THRUST - LEAST_THRUST);
		return share > 0.f ? std::min(1.f, share) : 0.f; // what is not a number: nothing
	}

	void move_gate(float passed, bool open)
	{
		if (passed > HOLD_S) { // the rate controller stood still: begin again
			_gate = 0.f;

		} else if (open) {
			_gate = std::min(1.f, _gate + passed / FADE_IN_S);

		} else {
			_gate = std::max(0.f, _gate - passed / FADE_OUT_S);
		}
	}

	static void move_limit(float &limit, float wanted, float passed)
	{
		if (valid_limit(wanted)) {
			limit += clip(wanted - limit, LIMIT_PER_S * passed);
		}
	}

	bool _heard{false};
	bool _stepped{false};
	uint64_t _stamp{0};      // of the gyro sample that the newest correction answers
	uint64_t _received{0};
	uint64_t _last_step{0};
	float _asked[3] {};
	float _limit[3] {};      // in force, on their way to what is set
	float _gate{0.f};        // share of the correction that is let in
};

} // namespace dob
