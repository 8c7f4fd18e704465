"""Online estimation by lines, and its results."""

import numpy as np
import pytest

import tandem


def test_tracker_equals_the_command_line():
    s = tandem.read_scenario("docking_a")
    odometry = zip(s.odometry.t, s.odometry.positions, s.odometry.quaternions)
    rows = [(name, *row) for name in ("usbl", "optical") for row in s.measurements[name]]
    rows = sorted(rows + [("odometry", t, *p, *q) for t, p, q in odometry], key=lambda row: row[1])
    with tandem.Tracker(s, window=30) as tracker:
        for row in rows[:300]:
            tracker.add(*row)
        updates = tracker.finish()
    assert updates and all("relative_m" in u for u in updates)


def test_tracker_rejects_bad_input():
    with pytest.raises(tandem.BadInputError, match="windw"):
        tandem.Tracker("docking_a", windw=30)
    with tandem.Tracker("docking_a") as tracker:
        with pytest.raises(tandem.BadInputError, match="NaN"):
            tracker.add("usbl", 0.0, np.nan, 0, 0)
        with pytest.raises(tandem.BadInputError):
            tracker.add("usbl\nodometry", 0.0, 0, 0, 0)
        with pytest.raises(tandem.BadInputError, match="did you mean usbl"):
            tracker.add("usb", 0.0, 0, 0, 0)
        with pytest.raises(tandem.BadInputError, match="expected 4 columns"):
            tracker.add("usbl", 0.0, 0)


def test_tracker_counts_rejected_rows():
    s = tandem.read_scenario("docking_a")
    odometry = np.column_stack([s.odometry.t, s.odometry.positions, s.odometry.quaternions])
    with tandem.Tracker(s, window=30) as tracker:
        tracker.add_rows("odometry", odometry[:100])
        tracker.add("usbl", odometry[90, 0], 10, 0, 0)
        tracker.add_rows("odometry", odometry[3:5])
        with pytest.warns(tandem.IncompleteWarning, match=r"2 of odometry \(time runs backwards\)"):
            tracker.finish()
        assert sum(tracker.rejected.values()) == 2 and tracker.summary.lines == 101
        with pytest.raises(tandem.Error, match="make a new Tracker"):
            tracker.add_rows("odometry", odometry[100:101])


def test_tracks_are_read_as_they_were_returned(tmp_path):
    result = tandem.track("docking_a", until=60.0, out=tmp_path / "run")
    again = tandem.read_results(tmp_path / "run")
    assert type(again) is type(result) and len(again.target.t) == len(result.target.t) > 0
