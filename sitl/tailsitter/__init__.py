"""The nonlinear airframe: a quadrotor tail-sitter as one rigid body with rotors, wing and flexible modes.

::

    parameters   every number, with unit and source
    layout       what stands where in the state and input vectors
    rotors, wing, flexible, battery      force, torque and rate of change, scalar functions
    body         all of them summed on a rigid body; RK4
    airframe     Tailsitter: the `Airframe` that a `Vehicle` flies
    trim         hover found by Newton's method; linearization

The functions between `rotors` and `body` are compiled when numba is installed (`compiled`) and are plain Python
otherwise: the same text, the same numbers. Import `sitl.tailsitter.airframe` only where one flies, since that compiles.
"""
