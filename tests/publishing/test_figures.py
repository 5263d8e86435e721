"""The command: files that come back, a README that is otherwise left alone, errors in one line."""

import pytest
from PIL import Image

from forestrl.publishing.files import ResultError
from forestrl.publishing.readme import replace_between_marks
from tests.commands import forestrl
from tests.publishing.folders import write_evaluation, write_training

FIGURES = [f"fig{name}" for name in ("3a", "3b", "3c", "4a", "4b", "4c")]
README = "# Title  \r\n\ntext <!-- results -->stale<!-- /results -->\nmore, no line end"


@pytest.fixture
def results(tmp_path):
    folder = tmp_path / "results"
    for setting in ("nominal", "trees75", "size75"):
        write_evaluation(folder, setting)
    write_evaluation(folder, name="learned_seed1", coverage=(0.7, 0.6))
    write_evaluation(folder, name="cost_published", rate=0.0)
    write_training(folder / "training" / "seed0.csv")
    (folder / "training" / "seed0.yaml").write_text("- experiment=paper\n- seed=0\n")
    return folder


def figures(folder, *arguments):
    return forestrl("figures", f"results={folder}", *(arguments or ("readme=null",)))


def test_every_figure_is_drawn_in_both_formats(results):
    result = figures(results)
    assert result.status == 0 and result.err == ""
    names = {path.name for path in (results / "figures").iterdir()}
    assert names == {f"{name}.{kind}" for name in FIGURES for kind in ("png", "pdf")}
    for name in FIGURES:
        assert (results / "figures" / f"{name}.pdf").read_bytes().startswith(b"%PDF")
        with Image.open(results / "figures" / f"{name}.png") as picture:
            assert picture.width == 1050  # 3.5 inches at 300 dots
            assert len(picture.convert("RGB").getcolors(10**6)) > 20


def test_a_deleted_figure_comes_back_byte_for_byte(results):
    figures(results)
    before = {path: path.read_bytes() for path in results.rglob("*.*") if path.is_file()}
    for name in ("fig3b.png", "fig4c.pdf"):
        (results / "figures" / name).unlink()
    (results / "table.md").unlink()
    figures(results)
    assert {path: path.read_bytes() for path in results.rglob("*.*") if path.is_file()} == before


def test_readme_gets_the_results_and_keeps_the_rest(results, tmp_path):
    readme = tmp_path / "README.md"
    readme.write_bytes(README.encode())
    for _ in range(2):  # the second time changes nothing
        assert figures(results, f"readme={readme}").status == 0
        text = readme.read_bytes().decode()
        assert text.startswith("# Title  \r\n\ntext <!-- results -->\n\n### In a minute")
        assert text.endswith("\n\n<!-- /results -->\nmore, no line end") and "stale" not in text
    for table in ("table.md", "differences.md"):
        assert (results / table).read_text().splitlines()[-1] in text
    assert '<img src="results/figures/fig4a.png"' in text
    assert f"forestrl eval policy=learned hydra.run.dir={results}/size75/learned\n" in text
    assert "forestrl train experiment=paper seed=0\n" in text


def write_sweep(folder, jobs):
    for name, overrides in jobs.items():
        hydra = folder / name / ".hydra"
        hydra.mkdir(parents=True)
        (hydra / "overrides.yaml").write_text("".join(f"- {override}\n" for override in overrides))
        write_training(folder / name / "metrics.csv", evaluated=(0.5,))


def test_committed_ablations_are_in_the_readme(results, tmp_path):
    jobs = {"0": ["ablation=none", "seed=0"], "1": ["ablation=no_filter", "seed=0"]}
    write_sweep(results / "ablations", jobs)
    readme = tmp_path / "README.md"
    readme.write_bytes(README.encode())
    assert figures(results, f"readme={readme}").status == 0
    text = readme.read_text()
    for line in (
        "### What each part is good for",
        "| `ablation=no_filter` | 1 seed | 3000 | 50.0 |",
    ):
        assert line in text and line in (results / "table.md").read_text()


def test_a_figure_without_data_is_skipped_with_what_it_wants(tmp_path):
    write_evaluation(tmp_path, "size75")
    result = figures(tmp_path)
    assert result.status == 0
    assert f"fig3a skipped: it wants, in {tmp_path}, training/seed<N>.csv" in result.out
    assert f"fig3b skipped: it wants, in {tmp_path}, nominal/learned/" in result.out
    assert {p.name for p in (tmp_path / "figures").iterdir()} == {"fig4a.png", "fig4a.pdf"}


def broken(folder, file, old, new):
    path = folder / file
    path.write_text(path.read_text().replace(old, new))


@pytest.mark.parametrize(
    ("breakage", "message"),
    [
        (lambda f: (f / "curve.csv").unlink(), "nominal/learned/curve.csv is missing"),
        (lambda f: (f / "summary.json").write_text("{"), "summary.json is not valid JSON"),
        (lambda f: (f / "summary.json").write_text("[]"), "summary.json lacks arenas"),
        (lambda f: (f / "episodes.csv").write_text(""), "episodes.csv lacks the column index"),
        (lambda f: broken(f, "episodes.csv", "0,0.9", "0,high"), "episodes.csv, line 2: could not"),
        (lambda f: broken(f, "episodes.csv", "0,0.9", "0.9"), "line 2: 4 fields instead of 5"),
        (lambda f: broken(f, "summary.json", '"arenas": 2', '"arenas": 3'), "has 2 rows"),
        (lambda f: broken(f, "summary.json", '"n_trees": 45', '"n_trees": 60'),
         "was evaluated with env.size=50 env.n_trees=60; nominal wants 50 and 45"),
    ],
)  # fmt: skip
def test_a_broken_file_gives_one_clear_line(tmp_path, breakage, message):
    breakage(write_evaluation(tmp_path))
    result = figures(tmp_path)
    assert result.status == 1 and result.err.count("\n") == 1
    assert result.err.startswith("forestrl figures: ") and message in result.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("results=nowhere",), "results=nowhere is not a folder"),
        (("sweep=nowhere",), "sweep=nowhere holds no job"),
        (("readme=nowhere.md",), "readme=nowhere.md is not a file"),
    ],
)
def test_wrong_paths_give_one_clear_line(results, arguments, message):
    result = forestrl("figures", f"results={results}", *arguments)
    assert result.status == 1 and result.err.count("\n") == 1 and message in result.err


def test_an_empty_folder_says_what_it_wants(tmp_path):
    assert "holds no results: it wants <setting>/<policy>/" in figures(tmp_path).err


@pytest.mark.parametrize(
    "text", ["none", "<!-- /results --><!-- results -->", 2 * "<!-- results --><!-- /results -->"]
)
def test_marks_must_be_there_once_in_order(text):
    with pytest.raises(ResultError, match="once each"):
        replace_between_marks(text, "new")


def test_a_sweep_is_summed_up_in_its_folder(tmp_path):
    write_sweep(tmp_path, {job: [f"reward.beta={job}", "seed=0"] for job in ("2", "10")})
    result = forestrl("figures", f"sweep={tmp_path}")
    assert result.status == 0
    table = (tmp_path / "table.md").read_text()
    assert table in result.out
    assert [line.split("`")[1] for line in table.splitlines()[2:4]] == [
        "reward.beta=2",
        "reward.beta=10",
    ]
    assert (tmp_path / "table.csv").read_text().startswith("override,over,frames,")
