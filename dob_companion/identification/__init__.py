"""From what was seen of an aircraft to a model of it, with its uncertainty. Pure: numpy and scipy, no file, no link.

::

    record       what was seen, as its source gave it
    grid         the same on one uniform grid, as the companion takes a link
    segments     what of it is in flight and excited, and by what
    spectra      the frequency response, unbiased in closed loop, with its bands
    known        filters and controllers by the autopilot's parameters
    checks       that it is the aircraft
    fit, held    a model behind a hold, structure and intervals
    bound        its uncertainty over frequency
    rigid        the same without flexible modes, which the bound then covers
    verdict      whether a design may be made from it
    identify     all of it
    result       what is handed on
    surroundings, controllers, spec   noise and wind, rate controllers, and the spec that `design` takes
"""
