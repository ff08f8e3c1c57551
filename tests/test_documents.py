"""What documents name is there: files, links, pictures, verbs with their options, names in Python.

Pages are run when the site is made (`nox -s docs`): those of `scripts/run_pages` as a whole, those of `scripts/run_commands`
with a short scene in place of each long one.
"""

from __future__ import annotations

import ast
import re
import shlex
import tomllib
from pathlib import Path

import pytest
import typer
from programs import load_program

import vgtsim
from vgtsim.cli import app

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [path for path in sorted(DOCS.rglob("*.md")) if not {"made", "_build"} & set(path.relative_to(DOCS).parts)]
TOP = [ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
DOCUMENTS = [*TOP, *PAGES, *sorted((ROOT / "models").glob("*/README.md"))]
NAMED = re.compile(r"`((?:[a-z0-9_]+/)+(?:[A-Za-z0-9_.]+)?|[a-z0-9_]+\.py)`")
TEST = re.compile(r"`(test_[a-z0-9_]+)`")
CODE = re.compile(r"`([A-Za-z_]+(?:\.[A-Za-z_]+)+)`")
LINK = re.compile(r"\]\((?!https?:|mailto:)([^)\s#]+)(?:#[^)\s]*)?\)")
ROOMS = [ROOT / "vgtsim", ROOT]
MOST_WORDS = 400  # of the README, which is one screen
MOST_BYTES, MOST_BYTES_OF_ALL = 300_000, 5_000_000  # of films in the gallery: a checkout stays small
# first words of commands that are other programs'
OTHERS = {"pip", "source", "nox", "dask", "cat", "pre-commit", "apt-get", "for", "done", "export", "cd"}
SPINE = {"README.md", "docs/python.md", "docs/architecture.md"}


def name_of(path):
    return path.relative_to(ROOT).as_posix()


@pytest.fixture(scope="module")
def run_pages():
    with pytest.MonkeyPatch.context() as patch:
        yield load_program(patch, "run_pages")


@pytest.fixture(scope="module")
def run_commands():
    with pytest.MonkeyPatch.context() as patch:
        yield load_program(patch, "run_commands")


def exists(name):
    """A path from the checkout, from the package or, for a file alone, anywhere in either."""
    if (
        name.startswith(("out/", "dist/", "docs/made/", "docs/_build/")) or name == "truss_pynite.py"
    ):  # left by commands
        return True
    if any((room / name).exists() for room in ROOMS):
        return True
    tops = ("vgtsim", "tests", "studies", "examples", "scripts")
    return "/" not in name and any(True for top in tops for _ in (ROOT / top).rglob(name))


def test_a_file_that_is_nowhere_would_be_seen():
    for name in ("newton.py", "positioning/newton.py"):
        assert exists(name)
        assert not exists(name.replace("newton", "nowhere"))


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_files_that_a_document_names_are_there(document):
    named = NAMED.findall(document.read_text(encoding="utf-8"))
    assert [name for name in named if not exists(name)] == []


@pytest.fixture(scope="module")
def sources():
    """Text of the package and its studies, and of the tests."""
    code, tests = (
        "\n".join(path.read_text(encoding="utf-8") for room in rooms for path in (ROOT / room).rglob("*.py"))
        for rooms in (("vgtsim", "studies"), ("tests",))
    )
    return code, tests


@pytest.mark.parametrize("document", PAGES, ids=name_of)
def test_tests_that_a_page_names_are_there(document, sources):
    named = TEST.findall(document.read_text(encoding="utf-8"))
    assert [name for name in named if f"def {name}(" not in sources[1] and not exists(f"{name}.py")] == []


@pytest.mark.parametrize("title", ["dissertation", "glossary"])
def test_code_that_stands_beside_an_equation_or_a_term_is_there(sources, title):
    """Names such as `file.function` and `Class.method`: the first part is a file, a folder or a class."""
    page = (DOCS / f"{title}.md").read_text(encoding="utf-8")
    named = [name for name in CODE.findall(page) if not name.endswith((".md", ".py"))]
    rooms = {
        path.stem for room in ("vgtsim", "studies") for path in (ROOT / room).rglob("*") if path.suffix in ("", ".py")
    }
    rooms |= {"vgtsim", "studies"}
    classes = set(re.findall(r"^class (\w+)", sources[0], re.MULTILINE))
    made = re.findall(r"\bdef (\w+)|^(?:    )?(\w+)(?:: | = )", sources[0], re.MULTILINE)
    known = rooms | classes | {name for pair in made for name in pair}
    assert [name for name in named if name.split(".")[0] not in rooms | classes or set(name.split(".")) - known] == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_links_of_a_document_lead_somewhere(document):
    """Pictures below `made` are left by the commands of a page, and are held when the site is made."""
    targets = [document.parent / link for link in LINK.findall(document.read_text(encoding="utf-8"))]
    assert [target for target in targets if "made" not in target.parts and not target.exists()] == []


def parse(line):
    """Let the command line read a line, and do nothing."""
    words = shlex.split(line, comments=True)
    words = words[: words.index("||") if "||" in words else None]
    words = words[: words.index(">") if ">" in words else None]
    command = typer.main.get_command(app)
    context = command.make_context("vgtsim", words[1:])
    name, verb, rest = command.resolve_command(context, [*context._protected_args, *context.args])
    verb.make_context(name, rest, parent=context)


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_commands_of_a_document_are_those_of_today(document, run_pages):
    for block in run_pages.read_blocks(document):
        if block.language not in ("sh", "bash", "console"):
            continue
        for line in block.text.splitlines():
            first, *_ = shlex.split(line, comments=True) or [""]
            if first == "vgtsim":
                parse(line.replace("$scene", "arm9_nullspace"))
            elif "/" in first:
                assert (ROOT / first).is_file(), line
            else:
                assert first in {"", *OTHERS}, line


def test_a_wrong_command_would_be_seen():
    parse("vgtsim run type_ii_reach --video  # film")
    for wrong in (
        "vgtsim runn type_ii_reach",
        "vgtsim run type_ii_reach --film",
        "vgtsim workspace arm9 --samples few",
    ):
        with pytest.raises(Exception, match=r"(?i)no such|valid integer"):
            parse(wrong)


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_programs_and_files_in_a_document_can_be_read(document, run_pages):
    for block in run_pages.read_blocks(document):
        if block.language == "toml":
            tomllib.loads(block.text)
        if block.language == "python":
            for node in ast.walk(ast.parse(block.text)):
                if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "vgtsim":
                    assert node.attr in vgtsim.__all__, node.attr


def test_every_page_has_its_place_in_the_site():
    index = (DOCS / "index.md").read_text()
    listed = {
        path
        for path in PAGES
        if path.parent.name == "tutorial" or path.relative_to(DOCS).with_suffix("").as_posix() in index.split()
    }
    assert {path.name for path in PAGES} - {path.name for path in listed} == {"index.md"}


def test_the_page_of_functions_has_every_public_name():
    listed = re.findall(r"^\.\. auto(?:function|class):: (\w+)$", (DOCS / "functions.md").read_text(), re.MULTILINE)
    assert sorted(listed) == sorted(set(vgtsim.__all__) - {"__version__"})


def test_each_page_that_is_run_ends_with_a_picture_of_its_own(run_pages):
    for page in run_pages.PAGES:
        if page.parent != DOCS:
            pictures = re.findall(r"!\[.*\]\(\.\./made/(\w+)/.*\)", page.read_text())
            assert set(pictures) == {page.stem}, page


def test_a_page_is_run_block_by_block(run_pages, tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "<!-- file: a.txt -->\n```text\nkept\n```\n\n<!-- not run: wrong -->\n```sh\nfalse\n```\n\n"
        "```sh\ncp a.txt b.txt\n```\n\n```python\nopen('c.txt', 'w').write(open('b.txt').read())\n```\n"
    )
    run_pages.run_page(page, tmp_path / "made")
    assert (tmp_path / "made/c.txt").read_text() == "kept\n"
    page.write_text("```sh\nfalse\ntrue\n```\n")
    with pytest.raises(SystemExit, match="status 1"):
        run_pages.run_page(page, tmp_path / "made")


def test_films_of_the_gallery_are_there_and_small():
    """Each is shown, and no more than a page of pictures is downloaded for it."""
    shown = re.findall(r'<video[^>]* src="([^"]+)"', (DOCS / "gallery.md").read_text())
    kept = {path: path.stat().st_size for path in (DOCS / "_static/films").glob("*.mp4")}
    assert sorted(DOCS / name for name in shown) == sorted(kept)
    assert {path.stem for path in kept} <= {path.stem for path in (ROOT / "scenes").glob("*.toml")}
    assert max(kept.values()) <= MOST_BYTES
    assert sum(kept.values()) <= MOST_BYTES_OF_ALL


def test_the_readme_is_one_screen():
    text = re.sub(r"```.*?```|\|.*?\|\n", "", (ROOT / "README.md").read_text(encoding="utf-8"), flags=re.DOTALL)
    assert len(text.split()) <= MOST_WORDS


def test_the_spine_of_the_documents_is_one(run_pages):
    """The same lines in all documents, comments apart."""
    programs = {
        ast.unparse(ast.parse(block.text)).removeprefix("import vgtsim\n")
        for name in SPINE
        for block in run_pages.read_blocks(ROOT / name)
        if "vgtsim.verify" in block.text
    }
    assert len(programs) == 1


def test_every_command_and_program_of_a_document_is_run_or_says_why_not(run_pages, run_commands):
    """By `run_pages` or `run_commands`, in CI; CONTRIBUTING has what CI itself does."""
    done = {*run_pages.PAGES, *run_commands.PAGES, ROOT / "CONTRIBUTING.md"}
    left = {
        name_of(document)
        for document in set(DOCUMENTS) - done
        for block in run_pages.read_blocks(document)
        if block.language in ("sh", "bash", "console", "python") and not block.left_out
    }
    assert left == set()


def test_what_takes_long_is_run_with_what_is_short(run_commands):
    jobs = [job for job in run_commands.read_jobs(DOCS / "command_line.md") if isinstance(job, str)]
    assert len(jobs) > 20
    runs = {line.split("#")[0].strip() for line in jobs if line.startswith("vgtsim run")}
    assert runs == {f"vgtsim run type_ii_reach.toml{option}" for option in ("", " --video", " --resume")}
    assert {line.split()[2] for line in jobs if line.startswith("vgtsim capacity")} == {"my_arm.toml"}
    assert any(line.startswith("vgtsim verify out/type_ii_reach --pdf") for line in jobs)


def test_a_wrong_line_ends_the_commands(run_commands, tmp_path):
    assert run_commands.run_line("vgtsim --version > version.txt", tmp_path) == ""
    assert run_commands.run_line("vgtsim check nothing.toml", tmp_path).startswith("status 2")
    assert "ZeroDivisionError" in run_commands.run_program(ast.parse("1 / 0"), tmp_path)
