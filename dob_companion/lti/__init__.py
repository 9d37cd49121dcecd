"""Linear time-invariant discrete systems: what designing, certifying and flying all count with. numpy only.

::

    statespace   StateSpaceData, four checked matrices; series, sum, side by side, wiring of parts
    response     G(e^{j angle}), its gain; spectral radius
    margins      delay and disk margin of a closed loop
    gramian      covariance of a stable system by doubling; the steady-state Kalman predictor
    predictor    what a design expects of the next gyro samples, and of those between two that are known
    wiring       block diagrams by the names of their signals
    loop         a vehicle with its observer, driven by the weights of its design
    filters      Butterworth sections

Whatever needs more than numpy (norms by proof, conversion, balancing) is `synthesis`'; python-control's StateSpace is
the type there. Functions here take anything that has matrices A, B, C, D.
"""
