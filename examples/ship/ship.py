"""A ship on a straight course, with position fixes and a log that measures its speed."""

import gainful as gf


def model(fix_sigma=2.0, log_sigma=0.25, speed_sigma=0.02):
    """Displacement and speed every 10 s.

    Args:
        fix_sigma: of a position fix [m].
        log_sigma: of the log [m/s]; what it has to be if nobody knows how the log errs.
        speed_sigma: change of speed in 10 s [m/s]; for a ship that holds its speed.
    """
    return gf.linear_model(
        [[1.0, 10.0], [0.0, 1.0]],
        [[1.0, 0.0], [0.0, 1.0]],
        Q=[0.1**2, speed_sigma**2],
        R=[fix_sigma**2, log_sigma**2],
        states={"place": "m", "speed": "m/s"},
        outputs={"fix": "m", "log": "m/s"},
    )
