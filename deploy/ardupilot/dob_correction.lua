-- dob_correction.lua: lets a dob-companion add its torque correction to the motor mixer of a multirotor.
-- SPDX-License-Identifier: Apache-2.0
--
-- ArduCopter (and the lift motors of a quadplane in ArduPlane), 4.5 or newer, stock firmware; docs/ardupilot.md.
-- With FRAME_CLASS (Q_FRAME_CLASS) 17 this script is the motor mixer: it loads the same factors as the stock frame, and
-- with no correction the motors turn exactly as with the stock frame.
--
-- How a correction gets in. The mixer puts out, for motor i,
--     throttle * throttle_factor[i] + roll * roll_factor[i] + pitch * pitch_factor[i] + yaw * yaw_factor[i]
-- and takes new factors in flight. With c = the correction, mixed for motor i, throttle_factor[i] = 1 + c / throttle
-- adds c to what the rate controller asks for.
--
-- In:  DEBUG_VECT "DOB_CORR" from component 191 of this system: moment to add, roll, pitch, yaw, each within -1..1. Its
--      HEARTBEAT alone gets answers too: who only listens, as a doctor does, is told as well.
-- Out: ACTUATOR_CONTROL_TARGET, group 0: [0..2] the moment at the mixer, correction included, [3] throttle, [4..6] the
--      correction in it, [7] its age in samples of DOBC_RATE (-1: none); its stamp is the time from which it acts.

local MAV_SEVERITY = {CRITICAL = 2, WARNING = 4, INFO = 6}
local HEARTBEAT, DEBUG_VECT, ACTUATOR_CONTROL_TARGET = 0, 250, 140
local COMPANION = 191
local CORRECTION = "DOB_CORR"

local PERIOD_MS = 1            -- asked for; the scripting thread gives what it can
local HOLD_US = 100000         -- without news for so long the last correction still acts
local FADE_OUT_US = 100000     -- then it goes to zero within this time; so it does when the pilot switches it off
local FADE_IN_US = 500000      -- and comes back no faster than this
local ANSWER_US = 5000000      -- a companion silent for so long gets no more answers
local RUN_US = 20000           -- the script runs this often even when it is held up; what it sets acts for so long at most
local LOOK_US = 20000          -- switch and flight are looked at this often: asking holds up the autopilot's main loop
local CHECK_US = 500000        -- parameters and arming check are looked at this often
local SAY_US = 1000000         -- at most one text in this time
local LIMIT_PER_S = 0.2        -- a changed limit is moved to at this rate
local LEAST_THROTTLE = 0.05    -- nothing is added below this throttle,
local FULL_THROTTLE = 0.10     -- and all of it from this one on
local HOVER_PITCH = 0.7854     -- a tail-sitter is out of hover with the nose below this, rad

local THROTTLE_UNLIMITED = 3                    -- motors:get_spool_state()
local SCRIPTING_MIXER = 17                      -- FRAME_CLASS
local SWITCH_HIGH = 2                           -- rc:get_aux_cached()
local AUX_FIRST, AUX_LAST = 300, 315            -- auxiliary functions Scripting1 to Scripting16
local PLANE = 3                                 -- FWVersion:type()

-- Airframes, as ArduPilot's own mixer has them, motor by motor: angle from the nose, clockwise seen from above, deg;
-- sense of its yaw moment (1: the propeller turns counter-clockwise); place in the motor test. Frame class, frame type.
local FRAMES = {
  [1] = {  -- quad
    name = "quad",
    [0] = {{90, 1, 2}, {-90, 1, 4}, {0, -1, 1}, {180, -1, 3}},              -- plus
    [1] = {{45, 1, 1}, {-135, 1, 3}, {-45, -1, 4}, {135, -1, 2}},           -- X
    [3] = {{45, -1, 1}, {-135, -1, 3}, {-45, 1, 4}, {135, 1, 2}},           -- H
  },
  [2] = {  -- hexa
    name = "hexa",
    [0] = {{0, -1, 1}, {180, 1, 4}, {-120, -1, 5}, {60, 1, 2}, {-60, 1, 6}, {120, -1, 3}},
    [1] = {{90, -1, 2}, {-90, 1, 5}, {-30, -1, 6}, {150, 1, 3}, {30, 1, 1}, {-150, -1, 4}},
  },
  [3] = {  -- octa
    name = "octa",
    [0] = {{0, -1, 1}, {180, -1, 5}, {45, 1, 2}, {135, 1, 4}, {-45, 1, 8}, {-135, 1, 6}, {-90, -1, 7}, {90, -1, 3}},
    [1] = {{22.5, -1, 1}, {-157.5, -1, 5}, {67.5, 1, 2}, {157.5, 1, 4}, {-22.5, 1, 8}, {-112.5, 1, 6}, {-67.5, -1, 7},
           {112.5, -1, 3}},
  },
}
local TYPES = {[0] = "plus", [1] = "X", [3] = "H"}

-- Parameters --------------------------------------------------------------------------------------------------------

local TABLE_KEY = 191
assert(param:add_table(TABLE_KEY, "DOBC_", 6), "DOBC: no parameter table")

local function own(index, name, default)
  assert(param:add_param(TABLE_KEY, index, name, default), "DOBC: no parameter " .. name)
  return Parameter("DOBC_" .. name)
end

-- DOBC_ENABLE  0: nothing is ever added; 1: corrections of the companion are added in flight
-- DOBC_FRAME   frame class that the aircraft has: 1 quad, 2 hexa, 3 octa. FRAME_TYPE stays what it was
-- DOBC_LIMIT   largest correction in roll and pitch, share of full control, 0 to 0.5
-- DOBC_LIMIT_Y largest correction in yaw, 0 to 0.5
-- DOBC_RC_FN   auxiliary function of the switch (300 to 315): high lets corrections in, middle and low do not. 0, or no
--              channel with this function: no switch
-- DOBC_RATE    the companion's design rate, Hz, for the age that is reported
local ENABLE = own(1, "ENABLE", 0)
local FRAME = own(2, "FRAME", 0)
local LIMIT = own(3, "LIMIT", 0.15)
local LIMIT_Y = own(4, "LIMIT_Y", 0.3)
local RC_FN = own(5, "RC_FN", AUX_FIRST)
local RATE = own(6, "RATE", 250)

-- State -------------------------------------------------------------------------------------------------------------

local factors = motor_factor_table()
local motor = {}                     -- roll, pitch and yaw factors of each motor

local function release_motors()
  for i = 1, #motor do
    factors:throttle(i - 1, 1)
  end
  Motors_dynamic:load_factors(factors)
end

-- The script may be ended from outside, without a chance to tidy up: time limit exceeded, scripting stopped. What it
-- leaves is then collected as garbage, and this is called; so no correction is ever left behind in the mixer.
local state = setmetatable({
  now_lo = 0, now_hi = 0,            -- time of the vehicle, µs, 64 bits in two
  stepped_lo = 0,                    -- when this run of the script began
  checked_us = CHECK_US,             -- since the last look at parameters
  looked_us = LOOK_US,               -- since the last look at switch and flight
  barred = "starting",               -- why nothing may be let in, companion aside; nil: nothing speaks against it
  setup = "starting",                -- what is wrong with the set-up; nil: nothing
  fault = nil,                       -- an error of this script; nothing is added any more
  class = 0, kind = 0,               -- airframe that the mixer was built for
  stock = false,                     -- the aircraft flies with a mixer of its own, without this script
  vtol = false, tailsitter = false,
  upright = false,                   -- a tail-sitter that has come to hover, and not left it
  rises_to = HOVER_PITCH,            -- pitch at which its motors are the multicopter's again after forward flight, rad
  enabled = false, switch = 0, rate = 250, headroom = 0.2,
  limit = 0, limit_yaw = 0,          -- in force, on their way to what the parameters say
  asked = 0, asked_yaw = 0,
  system = 0,                        -- MAVLink id of this vehicle
  channel = nil,                     -- link on which the companion was heard
  stamp_lo = nil, stamp_hi = nil,    -- gyro sample that the newest correction answers
  silence_us = 0,                    -- since the newest correction came
  unheard_us = 0,                    -- since anything came of the companion
  roll = 0, pitch = 0, yaw = 0,      -- the newest correction
  gate = 0,                          -- share of it that is let in
  clean = true,                      -- the mixer holds the neutral factors
  answered_us = 0,                   -- since the last answer
  told_lo = nil, told_hi = nil,      -- its stamp
  said = "", said_us = SAY_US,
}, {__gc = function() pcall(release_motors) end})

local COUNTERS = {"checked_us", "looked_us", "silence_us", "unheard_us", "answered_us", "said_us"}

local function say(severity, text)
  gcs:send_text(severity, "DOBC: " .. text)
end

-- Time: 32-bit halves, because a number of the script has 24 bits. Differences are exact within 35 minutes -----------

local function wrap(difference)
  return ((difference + 0x80000000) & 0xffffffff) - 0x80000000
end

local function read_clock()
  local lo = micros()
  state.now_lo = lo:toint()
  -- micros() wraps every 71.6 minutes: how often it has is what it differs from millis() by
  local ms_of_wraps = millis():tofloat() - lo:tofloat() / 1000
  state.now_hi = math.floor(ms_of_wraps / 4294967.296 + 0.5)
end

-- µs since the last run began: all of it, so that hold and fade do not wait while the script waits for the autopilot
local function begin_run()
  read_clock()
  local passed = wrap(state.now_lo - state.stepped_lo)
  state.stepped_lo = state.now_lo
  return passed
end

-- µs from a stamp to now, negative for the future; nil if it is not of this clock or more than 35 minutes away
local function since(lo, hi)
  local passed = wrap(state.now_lo - lo)
  local carry = 0
  if passed > 0 and math.ult(state.now_lo & 0xffffffff, lo & 0xffffffff) then
    carry = 1
  elseif passed < 0 and math.ult(lo & 0xffffffff, state.now_lo & 0xffffffff) then
    carry = -1
  end
  if hi + carry ~= state.now_hi then
    return nil
  end
  return passed
end

-- Receiving ---------------------------------------------------------------------------------------------------------

local function within_one(value)
  return value >= -1 and value <= 1      -- false for what is not a number
end

-- A message is passed in as ArduPilot's C structure: checksum, header, then the payload from byte 13 on
local function take(raw, channel)
  local length, _, _, _, system, component, number = string.unpack("<BBBBBBI3", raw, 4)
  if system ~= state.system or component ~= COMPANION then
    return
  end
  if number == HEARTBEAT then
    if not state.stamp_lo or state.silence_us >= ANSWER_US then   -- the link of the corrections goes before
      state.channel, state.unheard_us = channel, 0
    end
    return
  end
  local name = string.match(string.sub(raw, 33, 12 + length), "^[^\0]*")
  if name ~= CORRECTION then
    return
  end
  local lo, hi, roll, pitch, yaw = string.unpack("<i4i4fff", raw, 13)
  local age = since(lo, hi)
  if not (within_one(roll) and within_one(pitch) and within_one(yaw)) or not age or age < 0 then
    return
  end
  if state.stamp_lo and wrap(lo - state.stamp_lo) <= 0 and state.silence_us < ANSWER_US then
    return
  end
  state.stamp_lo, state.stamp_hi, state.channel = lo, hi, channel
  state.silence_us, state.unheard_us = 0, 0
  state.roll, state.pitch, state.yaw = roll, pitch, yaw
  return true
end

local function receive()
  local news = false
  for _ = 1, 25 do
    local raw, channel = mavlink:receive_chan()
    if not raw then
      break
    end
    news = take(raw, channel) or news
  end
  return news
end

-- May a correction act? ---------------------------------------------------------------------------------------------

local function switched_off()
  if state.switch == 0 then
    return false
  end
  local position = rc:get_aux_cached(state.switch)
  if position then
    return position ~= SWITCH_HIGH
  end
  return rc:find_channel_for_option(state.switch) ~= nil
end

local function in_hover()
  if not arming:is_armed() or motors:get_spool_state() ~= THROTTLE_UNLIMITED or not vehicle:get_likely_flying() then
    return false
  end
  if not state.vtol then
    return true
  end
  if not quadplane:in_vtol_mode() or quadplane:in_assisted_flight() then
    state.upright = false
    return false
  end
  if state.tailsitter then
    local pitch = ahrs.get_pitch_rad and ahrs:get_pitch_rad() or ahrs:get_pitch()
    state.upright = pitch > (state.upright and HOVER_PITCH or state.rises_to)
    return state.upright
  end
  return true
end

local function bar()
  if state.setup then
    return state.setup
  elseif not state.enabled then
    return "off by DOBC_ENABLE"
  elseif switched_off() then
    return "off by RC switch"
  elseif not in_hover() then
    return "not in hover"
  end
  return nil
end

local function move_gate(passed_us)
  if state.looked_us >= LOOK_US then
    state.looked_us = 0
    state.barred = bar()
  end
  local why = state.fault or state.barred
  -- what is set now acts until the next run: it is faded as far as silence will ask for by then
  local silence_us = state.silence_us + math.min(passed_us, RUN_US)
  if not why and (not state.stamp_lo or silence_us > HOLD_US) then
    why = "no companion"
  end
  if why then
    local left = (HOLD_US + FADE_OUT_US - silence_us) / FADE_OUT_US
    state.gate = math.max(0, math.min(state.gate - passed_us / FADE_OUT_US, left))
  else
    state.gate = math.min(1, state.gate + math.min(passed_us, HOLD_US) / FADE_IN_US)
  end
  why = why or "ready"
  if why ~= state.said and state.said_us >= SAY_US then
    state.said, state.said_us = why, 0
    say(state.fault and MAV_SEVERITY.CRITICAL or MAV_SEVERITY.INFO, why)
  end
end

-- Mixing ------------------------------------------------------------------------------------------------------------

local function clip(value, limit)
  return math.max(-limit, math.min(limit, value))
end

-- What ArduPilot's mixer makes of throttle and moment: share of roll, pitch and yaw, the yaw itself, the throttle
-- (AP_MotorsMatrix::output_armed_stabilizing, without voltage compensation and thrust boost).
local function desaturated(throttle, roll, pitch, yaw)
  local best, allowed = math.min(0.5, throttle), 1
  for _, m in ipairs(motor) do
    local there = best + roll * m.roll + pitch * m.pitch
    local room = yaw * m.yaw > 0 and 1 - there or there
    allowed = math.min(allowed, math.max(room, 0) / math.abs(m.yaw))
  end
  yaw = clip(yaw, math.max(allowed, state.headroom))
  local low, high = 1, -1
  for _, m in ipairs(motor) do
    local there = roll * m.roll + pitch * m.pitch + yaw * m.yaw
    low, high = math.min(low, there), math.max(high, there)
  end
  local share = 1
  if high - low > 1 then
    share = 1 / (high - low)
  end
  if throttle + low < 0 then
    share = math.min(share, -throttle / low)
  end
  return share, yaw, math.max(-low * share, math.min(throttle, 1 - high * share))
end

-- Adds a correction as far as every motor has room for it. Returns the correction that acts.
local function add(throttle, roll, pitch, yaw, c_roll, c_pitch, c_yaw)
  local share = math.max(0, math.min(1, (throttle - LEAST_THROTTLE) / (FULL_THROTTLE - LEAST_THROTTLE)))
  for _, m in ipairs(motor) do
    m.there = throttle + roll * m.roll + pitch * m.pitch + yaw * m.yaw
    m.more = c_roll * m.roll + c_pitch * m.pitch + c_yaw * m.yaw
    local room = m.more > 0 and 1 - m.there or m.there
    if math.abs(m.more) * share > room then
      share = math.max(0, room) / math.abs(m.more)
    end
  end
  if share == 0 or (c_roll == 0 and c_pitch == 0 and c_yaw == 0) then
    if not state.clean then
      release_motors()
      state.clean = true
    end
    return 0, 0, 0
  end
  for i, m in ipairs(motor) do
    factors:throttle(i - 1, 1 + share * m.more / throttle)
  end
  state.clean = false
  Motors_dynamic:load_factors(factors)
  return share * c_roll, share * c_pitch, share * c_yaw
end

local function answer(throttle, roll, pitch, yaw, c_roll, c_pitch, c_yaw)
  read_clock()
  local age = state.stamp_lo and state.silence_us <= HOLD_US + FADE_OUT_US and since(state.stamp_lo, state.stamp_hi)
  local lo, hi = wrap(state.now_lo), state.now_hi
  if state.told_lo and wrap(lo - state.told_lo) <= 0 then   -- the clock stands in a simulator; the newer answer counts
    lo = wrap(state.told_lo + 1)
    hi = state.told_hi + (lo == 0 and 1 or 0)
    age = age and age + wrap(lo - state.now_lo)
  end
  state.told_lo, state.told_hi = lo, hi
  local payload = string.pack("<i4i4ffffffffB", lo, hi, clip(roll + c_roll, 1),
    clip(pitch + c_pitch, 1), clip(yaw + c_yaw, 1), throttle, c_roll, c_pitch, c_yaw,
    age and age * 1e-6 * state.rate or -1, 0)
  mavlink:send_chan(state.channel, ACTUATOR_CONTROL_TARGET, payload)
end

-- Set-up ------------------------------------------------------------------------------------------------------------

local auth_id = arming:get_aux_auth_id()

local function value(name)
  return param:get(name)
end

local function airframe()
  return math.floor(FRAME:get()), math.floor(value(state.vtol and "Q_FRAME_TYPE" or "FRAME_TYPE") or -1)
end

-- A factor of 0.5 at most. One that is only the rounding of a cosine is 0: it must not claim room on a motor.
local function share_of(factor, largest)
  return math.abs(factor) < 1e-6 and 0 or 0.5 * factor / largest
end

local function build_mixer()
  local mixer = state.vtol and "Q_FRAME_CLASS" or "FRAME_CLASS"
  if value(mixer) ~= SCRIPTING_MIXER then
    state.stock = true
    return mixer .. " is not 17"
  end
  local class, kind = airframe()
  local family = FRAMES[class]
  local frame = family and family[kind]
  if not frame then
    return string.format("DOBC_FRAME %d type %d not known", class, kind)
  end
  state.class, state.kind = class, kind
  local largest_roll, largest_pitch = 0, 0
  for i, m in ipairs(frame) do
    local roll, pitch = math.cos(math.rad(m[1] + 90)), math.cos(math.rad(m[1]))
    motor[i] = {roll = roll, pitch = pitch, yaw = 0.5 * m[2], there = 0, more = 0}
    largest_roll, largest_pitch = math.max(largest_roll, math.abs(roll)), math.max(largest_pitch, math.abs(pitch))
    Motors_dynamic:add_motor(i - 1, m[3])
  end
  for i, m in ipairs(motor) do
    m.roll, m.pitch = share_of(m.roll, largest_roll), share_of(m.pitch, largest_pitch)
    factors:roll(i - 1, m.roll)
    factors:pitch(i - 1, m.pitch)
    factors:yaw(i - 1, m.yaw)
  end
  release_motors()
  if not Motors_dynamic:init(#motor) then
    return "mixer refused " .. family.name
  end
  motors:set_frame_string(family.name .. " " .. TYPES[kind] .. " DOBC")
  return nil
end

-- What is wrong with the values that may change at any time; nil: nothing
local function wrong_value()
  local class, kind = airframe()
  if class ~= state.class or kind ~= state.kind then
    return "frame changed, reboot"
  end
  local limit, limit_yaw, switch, rate = LIMIT:get(), LIMIT_Y:get(), RC_FN:get(), RATE:get()
  if not (limit >= 0 and limit <= 0.5) then
    return "DOBC_LIMIT not in 0..0.5"
  elseif not (limit_yaw >= 0 and limit_yaw <= 0.5) then
    return "DOBC_LIMIT_Y not in 0..0.5"
  elseif switch ~= 0 and not (switch >= AUX_FIRST and switch <= AUX_LAST) then
    return "DOBC_RC_FN not 0 or 300..315"
  elseif not (rate >= 10 and rate <= 1000) then
    return "DOBC_RATE not in 10..1000"
  end
  state.asked, state.asked_yaw, state.switch, state.rate = limit, limit_yaw, math.floor(switch), rate
  return nil
end

-- Until the nose has come up so far after forward flight, a tail-sitter's motors do not listen to the mixer
local function rises_to()
  local back, away = value("Q_TAILSIT_ANG_VT") or 0, value("Q_TAILSIT_ANGLE") or 0
  return math.max(HOVER_PITCH, math.rad(back > 0 and back or away))
end

local frame_error = "starting"

local function check()
  if #motor == 0 and not state.stock then
    frame_error = build_mixer()
  end
  state.enabled = ENABLE:get() == 1
  state.rises_to = rises_to()
  state.headroom = 0.001 * (value(state.vtol and "Q_M_YAW_HEADROOM" or "MOT_YAW_HEADROOM") or 200)
  state.setup = frame_error or wrong_value()
  local why = state.fault or state.setup
  if not auth_id then
    return
  elseif why and (state.fault or state.enabled or (frame_error and not state.stock)) then
    arming:set_aux_auth_failed(auth_id, "DOBC: " .. why)
  else
    arming:set_aux_auth_passed(auth_id)
  end
end

-- Loop --------------------------------------------------------------------------------------------------------------

local function inject(news)
  local throttle = motors:get_throttle()
  local roll = clip(motors:get_roll() + motors:get_roll_ff(), 1)
  local pitch = clip(motors:get_pitch() + motors:get_pitch_ff(), 1)
  local yaw = clip(motors:get_yaw() + motors:get_yaw_ff(), 1)
  local share, base
  share, yaw, base = desaturated(throttle, roll, pitch, yaw)
  roll, pitch, yaw = share * roll, share * pitch, share * yaw
  local g, limit = state.gate, state.limit
  local c_roll, c_pitch, c_yaw = add(base, roll, pitch, yaw, g * clip(state.roll, limit), g * clip(state.pitch, limit),
    g * clip(state.yaw, state.limit_yaw))
  local due = news or state.answered_us * state.rate >= 1000000
  if due and state.channel and state.unheard_us < ANSWER_US then
    state.answered_us = 0
    answer(throttle, roll, pitch, yaw, c_roll, c_pitch, c_yaw)
  end
end

local function step()
  local passed = begin_run()
  for _, counter in ipairs(COUNTERS) do
    state[counter] = math.min(state[counter] + passed, 1000000000)
  end
  if state.checked_us >= CHECK_US then
    state.checked_us = 0
    check()
  end
  local most = LIMIT_PER_S * passed * 1e-6
  state.limit = state.limit + clip(state.asked - state.limit, most)
  state.limit_yaw = state.limit_yaw + clip(state.asked_yaw - state.limit_yaw, most)
  local news = receive()
  move_gate(passed)
  if not frame_error then
    inject(news)
  end
end

-- An error in here must not leave a correction in the mixer: it is taken out at once, and none is added until a reboot.
local function update()
  local fine, problem = pcall(step)
  if not fine then
    state.gate, state.roll, state.pitch, state.yaw, state.clean = 0, 0, 0, 0, true
    pcall(release_motors)
    if not state.fault then
      state.fault = "script error, nothing is added"
      say(MAV_SEVERITY.CRITICAL, tostring(problem))
    end
  end
  return update, state.stock and 500 or PERIOD_MS
end

local function start()
  state.vtol = FWVersion:type() == PLANE
  state.tailsitter = state.vtol and (value("Q_TAILSIT_ENABLE") or 0) > 0
  state.system = value("MAV_SYSID") or value("SYSID_THISMAV")
  begin_run()
  check()
  mavlink:init(25, 2)
  mavlink:register_rx_msgid(DEBUG_VECT)
  mavlink:register_rx_msgid(HEARTBEAT)
  return update, PERIOD_MS
end

return start()
