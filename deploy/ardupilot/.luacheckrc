-- luacheck deploy/ardupilot/dob_correction.lua
std = "lua53"
read_globals = {
  "FWVersion", "Motors_dynamic", "Parameter", "ahrs", "arming", "gcs", "mavlink", "micros", "millis", "motor_factor_table",
  "motors", "param", "quadplane", "rc", "vehicle",
}
