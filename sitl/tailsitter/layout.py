"""What stands where: indices into the vectors that the compiled functions share.

State: position m and velocity m/s (north-east-down), quaternion (hover axes to north-east-down, scalar first), body
rate rad/s, rotor speeds rad/s, the disturbance behind the rotors' lag (normalized torque), flexible modes (three
coordinates, three rates), charge drawn as a share of the battery's.
"""

POSITION = 0
VELOCITY = 3
QUATERNION = 6
RATE = 10
ROTOR = 13
DISTURBANCE = 17
MODE = 20
MODE_RATE = 23
CHARGE = 26
STATES = 27

# Inputs, held for one step.
COMMAND = 0  # four rotors, share of full thrust
TORQUE = 4  # the paper's d, normalized
MOMENT = 7  # external, Nm, hover axes
WIND = 10  # m/s, north-east-down
WIND_RATE = 13  # rad/s, hover axes
WALL = 16  # m
EFFECTIVENESS = 17  # four rotors
GAIN = 21  # three axes
PAYLOAD = 24  # kg
CHARGE_AT_START = 25
SAG = 26  # 0 or 1
FLEXIBLE = 27  # 0 or 1
HELD = 28  # axis, or -1
STANDING = 29  # 0 or 1: on the ground, nothing moves but the rotors
INPUTS = 30

# Outputs of the last derivative.
SPECIFIC_FORCE = 0  # m/s², hover axes
ACCELERATION = 3  # m/s², north-east-down
PICKUP = 6  # what flexing adds to the gyro, rad/s
OUTPUTS = 9

# Scratch of one force and moment sum, hover axes.
FORCE = 0
TORQUE_SUM = 3
SPIN = 6  # angular momentum of the rotors, kg m²/s
AIR = 9  # velocity through the air, m/s
TURN = 12  # rate through the air, rad/s
MASS = 15  # with payload, kg
INERTIA = 16  # with payload, kg m²
SUMS = 19
