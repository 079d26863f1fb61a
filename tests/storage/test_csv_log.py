"""A log goes on in the columns of its rows, whatever version began it; nothing that was there is lost."""

import pytest

from jmorl.storage.csv_log import CsvLog, read_rows

ROW = {"policy": 2, "std_time": 0.5, "raw_time": None}
TODAY = "policy,std_time,raw_time\r\n1,0.25,9\r\n"

HEADERS = {
    "the same": (TODAY, TODAY),
    "one more": (
        "policy,std_time,mood,raw_time\r\n1,0.25,good,9\r\n",
        "policy,std_time,raw_time,mood\r\n1,0.25,9,good\r\n",
    ),
    "one fewer": ("policy,std_time\r\n1,0.25\r\n", "policy,std_time,raw_time\r\n1,0.25,\r\n"),
    "renamed": ("policy,spread_time,raw_time\r\n1,0.25,9\r\n", TODAY),
    "another order": ("raw_time,policy,std_time\r\n9,1,0.25\r\n", TODAY),
    "all of it": (
        'mood,spread_time,policy\r\n"a, b",0.25,1\r\n',
        'policy,std_time,raw_time,mood\r\n1,0.25,,"a, b"\r\n',
    ),
}


@pytest.mark.parametrize("name", HEADERS)
def test_rows_are_appended_under_their_own_names(tmp_path, name):
    before, after = HEADERS[name]
    log = CsvLog(tmp_path / "log.csv")
    log.restore(before)
    log.append([ROW])
    log.append([ROW | {"policy": 3}])
    more = "," * (after.count(",") // 2 - 2)
    expected = after + f"2,0.5,{more}\r\n3,0.5,{more}\r\n"
    assert (log.text, log.path.read_bytes().decode()) == (expected, expected)


def test_a_log_begins_with_the_names_of_its_first_rows(tmp_path):
    log = CsvLog(tmp_path / "log.csv")
    log.append([ROW, ROW])
    assert log.path.read_bytes() == b"policy,std_time,raw_time\r\n2,0.5,\r\n2,0.5,\r\n"


def test_a_file_of_another_version_is_rewritten_once(tmp_path, monkeypatch):
    log = CsvLog(tmp_path / "log.csv")
    log.restore(HEADERS["all of it"][0])
    rewritten = []
    restore = CsvLog.restore
    monkeypatch.setattr(CsvLog, "restore", lambda self, text: (rewritten.append(text), restore(self, text)))
    for _ in range(3):
        log.append([ROW])
    assert len(rewritten) == 1
    again = CsvLog(log.path)
    again.text = log.text
    again.append([ROW])
    assert len(rewritten) == 1


def test_columns_are_read_by_todays_names(tmp_path):
    path = tmp_path / "policies.csv"
    path.write_text("policy,spread_time,spread,sparsity\n1,0.25,x,2\n")
    assert read_rows(path) == [{"policy": "1", "std_time": "0.25", "spread": "x", "sparsity": "2"}]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a,b\n1,2\n1\n", "line 3 ends too early"),
        ("a,b\n1,2,3\n", "line 2 has more cells"),
        (f"a\n{'x' * 200_000}\n", "field larger"),
    ],
)
def test_lines_that_do_not_fit_the_header_are_named(tmp_path, text, message):
    path = tmp_path / "log.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=f"log.csv.*{message}"):
        read_rows(path)
