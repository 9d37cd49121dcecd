// SPDX-License-Identifier: Apache-2.0
// deploy/px4's plain core behind C functions, for tests/px4/test_core.py.

#include "Correction.hpp"

extern "C" {
void *create() { return new dob::Correction(); }
void destroy(void *core) { delete static_cast<dob::Correction *>(core); }

int take(void *core, const uint8_t *payload, int size, uint64_t now)
{
	return static_cast<int>(static_cast<dob::Correction *>(core)->take(payload, static_cast<uint8_t>(size), now));
}

void step(void *core, uint64_t now, int let_in, float thrust, const float *limit, float *added)
{
	static_cast<dob::Correction *>(core)->step(now, let_in != 0, thrust, limit, added);
}

int fresh(void *core, uint64_t now) { return static_cast<dob::Correction *>(core)->fresh(now); }
float age_us(void *core, uint64_t now) { return static_cast<dob::Correction *>(core)->age_us(now); }
int correction_type() { return dob::CORRECTION_TYPE; }
}
