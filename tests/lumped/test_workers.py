"""Tasks in threads and in processes of a cluster, of which some end."""

from __future__ import annotations

import os
import pickle
import signal
import threading
from functools import partial

import numpy as np
import pytest

from fegear.commands.map.study import respond_at, respond_over
from fegear.studies.running import Job, TaskProgress
from lumped.common.progress import silent
from lumped.common.workers import Cluster, NeverStop, NoClusterError, run_tasks
from lumped.rattle import basins
from lumped.rattle.basins import InitialGrid, settle_grid
from lumped.rattle.machine import Machine
from lumped.steady.integration_settings import Settings
from lumped.steady.maps import Axis, ParameterMap, run_map
from lumped.steady.sweep import DIRECTIONS

GRID = InitialGrid(side=60, velocity=(0.0, 7.0))
AT = partial(respond_at, 2000.0, Settings())
OVER = partial(respond_over, (1900.0, 2000.0), Settings(), DIRECTIONS, NeverStop())
MACHINE = Machine(damping=0.6, eccentricity=0.1, half_backlash=0.6)


def test_tasks_in_threads_are_handed_over_by_name():
    squares = {}
    tasks = ((n, lambda n=n: n * n) for n in range(50))
    run_tasks(tasks, squares.__setitem__, threading.Event(), 3)
    assert squares == {n: n * n for n in range(50)}


def test_a_cluster_that_is_not_there_is_told():
    with pytest.raises(NoClusterError, match=r"nowhere|dask"):
        run_tasks([], lambda *_: None, threading.Event(), Cluster("nowhere"))


@pytest.mark.parametrize(
    ("error", "reason"),
    [(AssertionError(), "AssertionError"), (OSError("gone\nand more"), "gone")],
)
def test_whatever_dask_makes_of_an_address_is_one_line(monkeypatch, error, reason):
    """One call in twenty ended in an assertion without a message."""
    distributed = pytest.importorskip("distributed")

    def fail(*_, **__):
        raise error

    monkeypatch.setattr(distributed, "Client", fail)
    with pytest.raises(NoClusterError, match=f"^scheduler nowhere: {reason}$"):
        run_tasks([], lambda *_: None, threading.Event(), Cluster("nowhere"))


@pytest.mark.slow
def test_a_worker_that_is_killed_changes_nothing(monkeypatch):
    """The other one computes its tiles, to the bit as threads do."""
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(basins, "CELLS_PER_TILE", 200)
    exact = settle_grid(MACHINE, GRID, 300)
    settings = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    killed, stored = [], {}
    with (
        distributed.LocalCluster(**settings) as here,
        distributed.Client(here, set_as_default=False) as client,
    ):

        def keep(name, arrays):
            stored[name] = arrays
            if not killed:
                victim = sorted(client.run(os.getpid).values())[0]
                os.kill(victim, signal.SIGKILL)
                killed.append(victim)

        def compute(parts):
            cluster = Cluster(here.scheduler_address)
            run_tasks(parts.items(), keep, threading.Event(), cluster)
            return stored

        settled = settle_grid(MACHINE, GRID, 300, compute)
    assert killed
    assert stored.keys() == {f"{number}" for number in range(18)}
    for one, other in zip(exact, settled, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("evaluate", [AT, OVER], ids=["a speed", "a band"])
def test_points_of_maps_can_go_to_other_processes(system, evaluate):
    """As they are sent: systems with what they have worked out, and what is asked."""
    train = system(harmonics=3)
    here = evaluate(train)
    sent = pickle.loads(pickle.dumps(partial(evaluate, train)))
    there = sent()
    np.testing.assert_array_equal(here.values, there.values)
    assert here.status == there.status


@pytest.mark.slow
def test_maps_in_processes_are_those_of_threads(system):
    pytest.importorskip("distributed")
    grid = ParameterMap((Axis("harmonics", (1.0, 2.0, 3.0)),), 2, {})

    def build(point):
        return system(harmonics=int(point[0]))

    board = TaskProgress(silent, {"points": 0})
    job = Job(None, "points", board, threading.Event(), Cluster())
    cluster = run_map(grid, build, AT, partial(job.compute, "points"))
    assert cluster.cells == run_map(grid, build, AT).cells
