"""Wrong use: exceptions that name the argument, and runs that stop."""

import os
import pathlib
import pickle
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
import tetmill


@pytest.mark.parametrize(
    ("options", "error", "text"),
    [
        ({"maxh": -1}, ValueError, "maxh"),
        ({"maxh": float("nan")}, ValueError, "maxh"),
        ({"maxh": "fine"}, TypeError, "maxh"),
        ({"levels": 1.5}, TypeError, "levels"),
        ({"levels": 11}, ValueError, "0 to 10"),
        ({"tets": 0}, ValueError, "tets"),
        ({"tets": 1e4, "levels": 2}, ValueError, "leave out"),
        ({"levels": 1, "pieces": 3}, ValueError, "exclude"),
        ({"parts": 0}, ValueError, "parts"),
        ({"method": "best"}, ValueError, "refine, surface, decompose"),
        ({"preset": "finest"}, ValueError, "very-fine"),
        ({"effort": "huge"}, ValueError, "thorough"),
        ({"planes": "x", "method": "decompose"}, ValueError, "axes"),
        ({"planes_from": [[0, 0, 0, 0, 0, 0]], "method": "decompose"}, ValueError, "length 0"),
        ({"size": 0.1}, TypeError, "maxh"),
        ({"size": lambda p: "x"}, TypeError, r"\(1, 3\)"),
        ({"size": lambda p: np.ones(2)}, TypeError, r"\(1, 3\)"),
        ({"size": lambda p: p[:, 0] * np.nan}, ValueError, "NaN"),
        ({"size": lambda p: 0.0}, ValueError, "positive"),
        ({"sources": [[0, 0, 0]]}, ValueError, r"\(n, 4\)"),
        ({"sources": [[0, 0, 0, -1]]}, ValueError, "positive"),
        ({"grading": 100}, tetmill.InputError, "grading"),
        ({"maxh": 1e-300}, tetmill.InputError, "maxh"),
        ({"parts": 5000}, tetmill.InputError, "coarse"),
        ({"mesh_size_file": "none.msz"}, tetmill.InputError, "none.msz"),
        ({"progress": 3}, TypeError, "progress"),
        ({"maxhh": 1}, TypeError, "maxhh"),
    ],
)
def test_wrong_options_are_refused(ball, options, error, text):
    with pytest.raises(error, match=text):
        ball.generate(**options)


POINTS = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]


@pytest.mark.parametrize(
    ("points", "triangles", "groups", "error", "text"),
    [
        (np.zeros((4, 2)), FACES, None, ValueError, r"\(n, 3\), not \(4, 2\)"),
        (np.array(POINTS, dtype=complex), FACES, None, TypeError, "complex"),
        ([[0, 0, np.nan], *POINTS[1:]], FACES, None, ValueError, r"points\[0\]"),
        (POINTS, np.array(FACES, dtype=float), None, TypeError, "integers"),
        (POINTS, [[0, 1, 4]], None, ValueError, "4 points"),
        (POINTS, [[0, 1, -1]], None, ValueError, "-1"),
        (POINTS, FACES, [1, 2], ValueError, r"\(4,\)"),
        (POINTS, FACES, [0, 1, 2, 3], ValueError, "0"),
        (POINTS, FACES[:3], None, tetmill.InputError, "closed|edge"),
        ([], [], None, ValueError, "points"),
    ],
)
def test_wrong_arrays_are_refused(points, triangles, groups, error, text):
    with pytest.raises(error, match=text):
        tetmill.Geometry.from_surface(points, triangles, groups)


def test_wrong_names_are_refused():
    with pytest.raises(TypeError, match="names"):
        tetmill.Geometry.from_surface(POINTS, FACES, [1, 1, 1, 1], names={"lid": 1})
    with pytest.raises(ValueError, match="positive"):
        tetmill.Grid((0, 0, 0), (1, 1, 1), -np.ones((2, 2, 2)))
    with pytest.raises(ValueError, match="three dimensions"):
        tetmill.Grid((0, 0, 0), (1, 1, 1), np.ones(8))


def test_errors_have_the_fields_of_the_library():
    with pytest.raises(tetmill.InputError) as caught:
        tetmill.Geometry.from_text("algebraic3d\nsolid b = sphere (0, 0, 0; 0);\ntlo b;")
    error = caught.value
    assert (error.line, error.column, error.file) == (2, 11, "geometry") and "radi" in error.hint
    assert isinstance(error, (tetmill.Error, ValueError)) and error.message == str(error)
    with pytest.raises(tetmill.InputError) as caught:
        tetmill.Geometry.from_text(
            "algebraic3d solid a = sphere (0, 0, 0; 1); solid b = sphere (1, 0, 0; 1); tlo a; tlo b;"
        )
    assert "overlap" in str(caught.value) and len(caught.value.place) == 3
    again = pickle.loads(pickle.dumps(caught.value))
    assert type(again) is tetmill.InputError and again.place == caught.value.place
    with pytest.raises(tetmill.InputError, match="none.geo"):
        tetmill.Geometry("none.geo")


def test_unknown_names_list_the_others(ball):
    mesh = ball.generate(maxh=0.5)
    with pytest.raises(tetmill.InputError, match="did you mean `skin`"):
        mesh.faces_named("skim")
    with pytest.raises(tetmill.InputError, match="`ball`"):
        mesh.tets_named("bell")


class Special(Exception):
    """Raised by callbacks only."""


@pytest.mark.parametrize("parts", [1, 3])
def test_exceptions_of_callbacks_are_raised_as_they_are(ball, parts):
    def raise_special(*_):
        raise Special("from a callback")

    for options in ({"size": raise_special}, {"progress": raise_special}):
        with pytest.raises(Special, match="from a callback"):
            ball.generate(maxh=0.3, levels=1, parts=parts, **options)


#: Windows has no signals that a process sends to itself, and does not fork.
posix = pytest.mark.skipif(os.name != "posix", reason="needs signals and fork")


@posix
@pytest.mark.parametrize("options", [{"maxh": 0.02}, {"maxh": 0.1, "levels": 5}, {"maxh": 0.02, "parts": 2}])
def test_ctrl_c_stops_a_run(ball, options):
    sent = []

    def interrupt():
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(0.5, interrupt)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        ball.generate(**options)
    assert time.monotonic() - sent[0] < 5
    timer.join()
    assert len(ball.generate(maxh=0.5).tets) > 0


@posix
def test_ctrl_c_stops_a_size_function(ball):
    def size(points):
        time.sleep(0.001)
        return np.full(len(points), 0.05)

    timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        ball.generate(size=size)
    timer.join()


def test_other_threads_run_meanwhile(ball):
    ticks, done = [], threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.005)

    thread = threading.Thread(target=tick)
    thread.start()
    ball.generate(maxh=0.07)
    done.set()
    thread.join()
    assert len(ticks) > 10 and max(np.diff(ticks)) < 0.5


def test_runs_in_threads_do_not_wait_for_each_other(ball):
    made = []

    def run():
        made.append(ball.generate(size=lambda p: np.full(len(p), 0.3)).quality()["tets"])

    threads = [threading.Thread(target=run) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert len(made) == 4 and len(set(made)) == 1


@posix
def test_a_forked_process_is_refused(ball):
    ball.generate(maxh=0.6)
    child = os.fork()
    if child == 0:
        try:
            ball.generate(maxh=0.6)
        except RuntimeError as error:
            os._exit(0 if "spawn" in str(error) else 1)
        os._exit(2)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def test_threads_are_set_before_the_first_run(ball):
    ball.generate(maxh=0.6)
    with pytest.raises(RuntimeError, match="before"):
        tetmill.set_threads(1)
    code = "import tetmill; tetmill.set_threads(1); g = tetmill.csg.Sphere((0, 0, 0), 1).geometry(); " \
        "print(g.generate(maxh=0.5).report['threads'])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "1"


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="needs /proc")
def test_nothing_leaks():
    script = pathlib.Path(__file__).with_name("leaks.py")
    environment = {**os.environ, "MALLOC_ARENA_MAX": "1"}
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, env=environment, check=True)
    growth, tets = map(int, done.stdout.split())
    # Twenty leaked meshes would take more than 20 times their tets; memory is fragmented.
    assert growth < 4 * tets


def test_wrong_background_meshes():
    points, tets = np.eye(4)[:, :3], [[0, 1, 2, 3]]
    for sizes, text in (
        ([1.0, 1.0], "shape"),
        ([1.0, 1.0, 0.0, 1.0], "point 2 of the background mesh has the size 0"),
        ([1.0, np.nan, 1.0, 1.0], "point 1"),
    ):
        with pytest.raises(ValueError, match=text):
            tetmill.Background(points, tets, sizes)
    with pytest.raises(ValueError, match="no tets"):
        tetmill.Background(points, np.empty((0, 4), dtype=int), np.ones(4))
    with pytest.raises(ValueError, match="tets"):
        tetmill.Background(points, [[0, 1, 2, 4]], np.ones(4))
