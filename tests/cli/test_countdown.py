"""How long `design --auto` still takes, as it says while it works."""

from dob_companion.cli.countdown import Countdown


def test_the_time_left_follows_what_the_work_has_taken():
    now, shown = [100.0], []
    countdown = Countdown(lambda: now[0], shown.append)
    countdown.say("pitch, roll, yaw: finding weights")
    countdown.begin(18.0)
    assert shown == ["pitch, roll, yaw: finding weights"]
    now[0] += 6.0
    assert countdown.line() == "pitch, roll, yaw: finding weights, about 12 s left"
    now[0] += 6.0  # slower than expected: two thirds of it in 24 s make 36
    now[0] += 12.0
    assert countdown.line() == "pitch, roll, yaw: finding weights, nearly done"
    countdown.done(2.0 / 3.0)
    countdown.say("2 of 3 designed")
    assert shown[-1] == "2 of 3 designed, about 12 s left"


def test_its_line_is_cleared_however_the_work_ends():
    shown = []
    try:
        with Countdown(show=shown.append) as countdown:
            countdown.say("finding weights")
            raise ValueError
    except ValueError:
        assert shown == ["finding weights", ""]
