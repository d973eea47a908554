"""The table of times by folder and test."""

from __future__ import annotations

import measured_times

CASES = {
    "tests.fegear.contact.test_face::test_a[1]": 4.0,
    "tests.fegear.contact.test_face::test_a[2]": 1.5,
    "tests.lumped.test_modes::test_b": 0.5,
}


def test_times_are_summed_by_folder(tmp_path):
    cases = [name.split("::") for name in CASES]
    lines = [
        f'<testcase classname="{place}" name="{name}" time="{time}"/>'
        for (place, name), time in zip(cases, CASES.values(), strict=True)
    ]
    path = tmp_path / "times.xml"
    path.write_text(f"<testsuites><testsuite>{''.join(lines)}</testsuite></testsuites>")
    times = measured_times.measured(path)
    assert dict(times) == CASES
    assert measured_times.sums(times, 2) == [
        ("fegear/contact", 2, 5.5),
        ("lumped/test_modes", 1, 0.5),
    ]
    text = list(measured_times.report(path, 2))
    assert text[:2] == ["3 tests, 6 s", "above 5 s: 0 tests, 0 s"]
    assert "above 1 s: 2 tests, 6 s" in text
