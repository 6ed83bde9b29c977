"""The notebook runs, and its arrays are those of the talk: by closed forms and the pages of docs."""

import pathlib
import runpy

import numpy as np

NOTEBOOK = pathlib.Path(__file__).resolve().parents[1] / "notebooks/talk.py"


def test_the_figures_of_the_talk(monkeypatch):
    samples = 20_000
    monkeypatch.setenv("SAMPLES", str(samples))
    monkeypatch.setenv("MPLBACKEND", "Agg")
    found = runpy.run_path(str(NOTEBOOK))
    # docs/orders.md, conductor, α 1, cosθ 1 and 0.5: the first order and the second, 200 000 walks.
    page = (NOTEBOOK.parents[2] / "docs/orders.md").read_text()
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in page.splitlines() if line.startswith("| conductor | 1 |")]
    shares = {float(row[2]): [float(cell) / 100 for cell in row[3:5]] for row in rows}
    assert {1.0, 0.5} <= shares.keys()
    for at, cos in enumerate((1.0, 0.5)):
        for order in (0, 1):
            expected = shares[cos][order]
            error = np.sqrt(expected * (1 - expected) * (1 / samples + 1 / 200_000))
            assert abs(found["furnace"]["conductor"][-1, at, order] - expected) < 4.5 * error + 5e-5
    # Metal sends nothing through; glass sends light of some order everywhere.
    assert (found["lobes"]["conductor"][np.abs(np.degrees(found["angles"])) > 90] == 0.0).all()
    assert (found["lobes"]["dielectric"].sum(1) > 0.0).all()
    # The first facet from outside, at normal incidence, is at a height of the surface; tilted, higher.
    means = found["means"]
    assert abs(means["outside, normal incidence"]) < 4.5 / np.sqrt(samples) < 0.5 < means["outside, cosθ 0.1"]
    assert means["inside, going down"] < -0.3
    assert (found["multiple"][-1] > found["single"][-1] * np.array(found["GOLD"])).all()
