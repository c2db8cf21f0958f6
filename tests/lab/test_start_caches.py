"""No state of the cache of models changes a picture."""

import os
from concurrent.futures import ThreadPoolExecutor

from firefly_sample.disk_cache import VARIABLE
from tests.lab.first_pictures import picture, picture_here


def test_the_forest_is_the_same_with_the_cache_off_empty_full_damaged_and_shut(tmp_path, monkeypatch, capfd):
    """Two processes fill the cache at once; this one, which keeps no model, draws the other pictures."""

    def here(folder):
        monkeypatch.setenv(VARIABLE, str(folder))
        digest = picture_here("forest")
        assert capfd.readouterr() == ("", "")
        return digest

    folder = tmp_path / "kept"
    plain = here("off")
    with ThreadPoolExecutor() as pool:  # two fill it at once
        assert set(pool.map(picture, ["forest"] * 2, [folder] * 2)) == {plain}
    files = sorted(folder.iterdir())
    assert {path.name.split("-")[0] for path in files} == {"model", "texture"}
    assert {path.suffix for path in files} == {".derived"}
    written = {path: path.stat().st_ino for path in files}
    assert here(folder) == plain
    assert {path: path.stat().st_ino for path in files} == written  # nothing was made again
    for number, path in enumerate(files):
        if number % 3 == 0:
            path.unlink()
        elif number % 3 == 1:
            os.truncate(path, path.stat().st_size // 2)
    assert here(folder) == plain
    (tmp_path / "file").write_text("")
    assert here(tmp_path / "file" / "kept") == plain
