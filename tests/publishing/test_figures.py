"""The command: files that come back, a README that is otherwise left alone, errors in one line."""

import pytest
from PIL import Image

from forestrl.evaluation.reading import ResultError
from forestrl.publishing.page import replace_between_marks
from tests.commands import forestrl
from tests.publishing.folders import write_evaluation, write_job, write_training

FIGURES = [f"fig{name}" for name in ("3a", "3b", "3c", "4a", "4b", "4c")]
README = "# Title  \r\n\ntext <!-- table -->stale<!-- /table -->\nmore, no line end"


@pytest.fixture
def results(tmp_path):
    folder = tmp_path / "results"
    for setting in ("nominal", "trees75", "size75"):
        write_evaluation(folder, setting)
    write_evaluation(folder, name="paper_seed1", coverage=(0.7, 0.6))
    write_evaluation(folder, name="cost_published", rate=0.0)
    write_training(folder / "training" / "seed0.csv")
    (folder / "training" / "seed0.yaml").write_text("- experiment=paper\n- seed=0\n")
    return folder


def figures(folder, *arguments):
    asked = arguments or ("readme=null",)
    return forestrl("figures", f"results={folder}", f"page={folder}/page.md", *asked)


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
    (results / "page.md").unlink()
    figures(results)
    assert {path: path.read_bytes() for path in results.rglob("*.*") if path.is_file()} == before


def test_readme_gets_the_numbers_and_keeps_the_rest(results, tmp_path):
    readme = tmp_path / "README.md"
    readme.write_bytes(README.encode())
    for _ in range(2):  # the second time changes nothing
        assert figures(results, f"readme={readme}").status == 0
        text = readme.read_bytes().decode()
        assert text.startswith("# Title  \r\n\ntext <!-- table -->\n\n| policy")
        assert text.endswith("\n\n<!-- /table -->\nmore, no line end") and "stale" not in text


def test_the_page_has_tables_figures_and_the_commands_behind_them(results):
    figures(results)
    text = (results / "page.md").read_text()
    headings = [line for line in text.splitlines() if line.startswith("## ")]
    assert headings[0] == "## In a minute" and headings[-1] == "## Figures"
    assert "## What each part is good for" not in headings  # there are no ablations
    assert '<img src="figures/fig4a.png"' in text and "{" not in text.replace("/{", "")
    assert f"forestrl eval policy=paper hydra.run.dir={results}/size75/paper\n" in text
    assert "forestrl train experiment=paper seed=0\n" in text


def test_a_method_that_was_not_measured_is_refused_with_those_that_were(results):
    result = figures(results, "method=leaned", "readme=null")
    assert result.status == 1 and result.err.count("\n") == 1
    assert f"method=leaned is not in {results}: it has cost_published, paper" in result.err


def write_sweep(folder, jobs):
    for name, overrides in jobs.items():
        job = write_job(folder / name, *overrides)
        write_training(job / "metrics.csv", evaluated=(0.5,))


def test_committed_ablations_are_on_the_page(results):
    jobs = {"0": ["ablation=none", "seed=0"], "1": ["ablation=no_filter", "seed=0"]}
    write_sweep(results / "ablations", jobs)
    assert figures(results).status == 0
    text = (results / "page.md").read_text()
    assert "## What each part is good for" in text
    (line,) = (line for line in text.splitlines() if "`ablation=no_filter`" in line)
    assert [cell.strip() for cell in line.split("|")][2:5] == ["1 seed", "3000", "50.0"]


def test_a_figure_without_data_is_skipped_with_what_it_wants(tmp_path):
    write_evaluation(tmp_path, "size75")
    result = figures(tmp_path)
    assert result.status == 0
    assert f"fig3a skipped: it wants, in {tmp_path}, training/seed<N>.csv" in result.out
    assert f"fig3b skipped: it wants, in {tmp_path}, nominal/paper/" in result.out
    assert {p.name for p in (tmp_path / "figures").iterdir()} == {"fig4a.png", "fig4a.pdf"}


def broken(folder, file, old, new):
    path = folder / file
    path.write_text(path.read_text().replace(old, new))


@pytest.mark.parametrize(
    ("breakage", "message"),
    [
        (lambda f: (f / "curve.csv").unlink(), "nominal/paper/curve.csv is missing"),
        (lambda f: (f / "summary.json").write_text("{"), "summary.json is not valid JSON"),
        (lambda f: (f / "summary.json").write_text("[]"), "summary.json lacks arenas"),
        (lambda f: (f / "episodes.csv").write_text(""), "episodes.csv cannot be read: No columns"),
        (lambda f: broken(f, "episodes.csv", "0,0.9", "0,high"), "line 2: coverage is 'high'"),
        (lambda f: broken(f, "episodes.csv", "1,0.8", "1,0.8,7"), "cannot be read: Error token"),
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
    result = forestrl("figures", f"results={results}", "page=null", *arguments)
    assert result.status == 1 and result.err.count("\n") == 1 and message in result.err


def test_an_empty_folder_says_what_it_wants(tmp_path):
    assert "holds no results: it wants <setting>/<policy>/" in figures(tmp_path).err


@pytest.mark.parametrize(
    "text", ["none", "<!-- /table --><!-- table -->", 2 * "<!-- table --><!-- /table -->"]
)
def test_marks_must_be_there_once_in_order(text):
    with pytest.raises(ResultError, match="once each"):
        replace_between_marks(text, "table", "new")


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
