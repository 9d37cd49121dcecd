"""Reading parameters by name: lost answers are asked for again, what nobody has is given up, few are open at once."""

from dob_companion.doctor.reading import AT_ONCE, RETRY_S, TRIES, ParameterReading


def read(names, answers, loses=0):
    """Runs a reading to its end: how often each name was asked for, and when it was done."""
    reading, asked, now, lost = ParameterReading(names), {}, 0.0, loses
    while not reading.done and now < 60.0:
        due = reading.due(now)
        assert len(due) <= AT_ONCE
        for name in due:
            asked[name] = asked.get(name, 0) + 1
            if lost:
                lost -= 1
            elif name in answers:
                reading.told(name)
        if not reading.done:
            now = max(now, reading.deadline)
    assert reading.done
    return asked, now


def test_each_is_asked_for_once_where_all_are_told():
    names = tuple(f"P{k}" for k in range(50))
    assert read(names, names)[0] == dict.fromkeys(names, 1)


def test_a_lost_answer_is_asked_for_again():
    asked, _ = read(("A", "B"), ("A", "B"), loses=1)
    assert asked == {"A": 2, "B": 1}


def test_what_nobody_has_is_given_up():
    asked, now = read(("A", "B"), ("B",))
    assert asked == {"A": TRIES, "B": 1}
    assert now < 2 * TRIES * RETRY_S


def test_nothing_wanted_is_done_at_once():
    assert ParameterReading(()).done
