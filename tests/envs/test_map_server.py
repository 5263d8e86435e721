"""Files of ROS's map_server: its rules, and what is refused."""

import re

import numpy as np
import pytest
import yaml
from hypothesis import given
from PIL import Image

from forestrl.envs import GridMap, read_map, write_map
from forestrl.envs.worlds.map_server import map_files
from forestrl.envs.worlds.mapped import SHIPPED
from forestrl.functional import Cell
from tests.envs.maps import DATA, FIELDS, cells, drawing, origins, save

ROBOT_MAPS = [
    DATA / "lse_arena.yaml",
    DATA / "turtlebot3_world.yaml",
    SHIPPED / "maps" / "aws_small_warehouse.yaml",
]
U, F, T = Cell.UNKNOWN, Cell.FREE, Cell.OCCUPIED


def states(tmp_path, pixels, **fields):
    return read_map(save(tmp_path, pixels, **fields)).cells.ravel().tolist()


# occupancy of 205: 50/255 = 0.1961; of 206: 0.1922; of 89: 0.651; of 90: 0.647
GREYS = [[255, 254, 206, 205, 90, 89, 0]]


def test_dark_is_occupied_bright_is_free_and_unknown_is_between(tmp_path):
    assert states(tmp_path, GREYS) == [F, F, F, U, U, T, T]


def test_negate_swaps_dark_and_bright(tmp_path):
    """Occupancies: 1, 0.996, 0.81, 0.80, 0.353, 0.349, 0."""
    assert states(tmp_path, GREYS, negate=1) == [T, T, T, T, U, U, F]


def test_thresholds_are_the_files_own_and_are_not_reached(tmp_path):
    assert states(tmp_path, GREYS, occupied_thresh=0.2, free_thresh=0.1) == [F, F, U, U, T, T, T]
    assert states(tmp_path, [[0, 51, 255]], occupied_thresh=0.8, free_thresh=0.8) == [T, U, F]


def test_raw_pixels_are_per_cent_whatever_negate_says(tmp_path):
    raw = {"mode": "raw", "negate": 1}
    assert states(tmp_path, [[0, 19, 20, 65, 66, 100, 101, 255]], **raw) == [F, F, U, U, T, T, U, U]


@pytest.mark.parametrize("mode", ["trinary", "scale"])
def test_transparent_pixels_are_unknown_and_colours_are_averaged(mode, tmp_path):
    pixels = [[[255, 255, 255, 0], [255, 255, 255, 255], [0, 0, 0, 255], [255, 0, 0, 255]]]
    assert states(tmp_path, pixels, mode=mode) == [U, F, T, T]  # 1 - 85/255 = 0.667
    assert states(tmp_path, [[[255, 254, 253], [120, 0, 240]]], mode=mode) == [F, U]


def test_the_images_first_row_has_the_largest_y(tmp_path):
    grid = read_map(save(tmp_path, [[0, 255, 255], [255, 255, 255]]))
    assert grid.cells[grid.cell_at((1.25, -1.25))] == T  # over 1.25, -1.75 in the corner
    assert grid.cells[grid.cell_at((1.25, -1.75))] == F


def test_a_turned_map_keeps_its_place(tmp_path):
    grid = read_map(save(tmp_path, [[255, 255]], origin=[3.0, 4.0, 1.5707963]))
    assert grid.point_at(0, 1) == pytest.approx((2.75, 4.75), abs=1e-6)


def plain_greys(path):
    """Reads an image without what is tested: a PGM byte by byte, a PNG of colours by Pillow."""
    if path.suffix == ".png":
        return np.asarray(Image.open(path)).astype(float).mean(-1)
    head = rb"P5\n(?:#.*\n)*(\d+) (\d+)\n255\n"
    match = re.match(head, data := path.read_bytes())
    width, height = int(match[1]), int(match[2])
    return np.frombuffer(data[match.end() :], np.uint8).reshape(height, width).astype(float)


@pytest.mark.parametrize("path", ROBOT_MAPS, ids=lambda path: path.stem)
def test_a_robots_map_is_read_by_the_rule(path):
    grid = read_map(path)
    occupancy = (255 - plain_greys(path.parent / yaml.safe_load(path.read_text())["image"])) / 255
    assert grid.shape == occupancy.shape
    assert np.array_equal(grid.cells == T, occupancy > 0.65)
    assert np.array_equal(grid.cells == F, occupancy < 0.196)
    assert {"lse_arena": 2}.get(path.stem, 3) == len(np.unique(grid.cells))


@pytest.mark.parametrize("image", ["pgm", "png"])
@pytest.mark.parametrize("path", ROBOT_MAPS, ids=lambda path: path.stem)
def test_a_robots_map_comes_back_cell_for_cell(path, image, tmp_path):
    grid = read_map(path)
    write_map(tmp_path / "map.yaml", grid, image)
    again = read_map(tmp_path / "map.yaml")
    assert np.array_equal(again.cells, grid.cells)
    assert (again.cell_size, again.origin) == (grid.cell_size, grid.origin)


@given(cells, origins)
def test_any_map_comes_back_cell_for_cell(tmp_path_factory, cells, origin):
    path = tmp_path_factory.mktemp("map") / "map.yaml"
    cells.flat[0] = Cell.FREE
    write_map(path, GridMap(cells, 0.15, origin))
    again = read_map(path)
    assert np.array_equal(again.cells, cells)
    assert (again.cell_size, again.origin) == (0.15, origin)


def test_an_image_alone_needs_a_resolution_and_takes_what_else_is_given(tmp_path):
    save(tmp_path, GREYS)
    (tmp_path / "map.yaml").unlink()
    image = tmp_path / "map.png"
    with pytest.raises(ValueError, match=r"map.png: resolution: null is not allowed: .*metres"):
        read_map(image)
    grid = read_map(image, {"resolution": 0.1, "negate": True})
    assert (grid.cell_size, grid.origin) == (0.1, (0.0, 0.0, 0.0))
    assert grid.cells.ravel().tolist() == [T, T, T, T, U, U, F]


def test_what_is_given_holds_in_place_of_what_the_file_says(tmp_path):
    grid = read_map(save(tmp_path, GREYS, resolution=None), {"resolution": 2})
    assert (grid.cell_size, grid.origin) == (2.0, (1.0, -2.0, 0.0))


def test_the_start_is_in_the_middle_of_the_pixels_that_mark_it(tmp_path):
    pixels = np.full((5, 7, 3), 127, np.uint8)
    pixels[1:4, 3:6] = (255, 216, 0)
    grid = read_map(save(tmp_path, pixels, free_thresh=0.6), start_colour=(255, 216, 0))
    assert grid.cell_at(grid.start) == (2, 4)
    path = save(tmp_path, pixels[:1], free_thresh=0.6)
    with pytest.raises(ValueError, match=r"map.png: colours: \[255,216,0\] .*no pixel"):
        read_map(path, start_colour=(255, 216, 0))


def test_a_folders_maps_are_its_yaml_files_and_the_images_without_one(tmp_path):
    path = save(tmp_path, GREYS)
    Image.new("L", (3, 3), 255).save(tmp_path / "alone.PGM", "PPM")
    (tmp_path / "notes.txt").touch()
    assert map_files(tmp_path) == [tmp_path / "alone.PGM", path]
    assert map_files(path) == [path]


WRONG = [
    ({"resolution": 0}, "resolution: 0 is not allowed: .* more than 0"),
    ({"resolution": -0.05}, "resolution: -0.05 is not allowed"),
    ({"resolution": "fine"}, "resolution: fine is not allowed: it must be a number"),
    ({"resolution": float("nan")}, "resolution: nan is not allowed"),
    ({"resolution": None}, "there is no resolution, which is needed: a number"),
    ({"origin": None}, "there is no origin, which is needed: a list of 3 numbers"),
    ({"origin": [0, 0]}, r"origin: \[0,0\] is not allowed: it must be a list of 3 numbers"),
    ({"origin": [0, 0, "north"]}, r"origin: \[0,0,north\] is not allowed"),
    ({"negate": 2}, "negate: 2 is not allowed: it must be 0 or 1"),
    ({"occupied_thresh": 65}, "occupied_thresh: 65 is not allowed: .*from 0 to 1"),
    ({"free_thresh": 0.7}, "free_thresh: 0.7 is not allowed: it must be at most 0.65"),
    ({"free_thresh": 0.0}, "free_thresh: 0.0 is not allowed: it leaves no free cell.* 0.000"),
    ({"mode": "binary"}, "mode: binary is not allowed: it must be trinary, scale or raw"),
    ({"image": None}, "there is no image, which is needed: text"),
    ({"image": 3}, "image: 3 is not allowed: it must be text"),
    ({"image": "other.png"}, "other.png: there is no such image"),
    ({"image": "map.yaml"}, "map.yaml cannot be read as an image"),
]


@pytest.mark.parametrize(("fields", "message"), WRONG)
def test_a_file_that_makes_no_sense_is_refused_by_name_field_and_value(fields, message, tmp_path):
    path = save(tmp_path, GREYS, **fields)
    with pytest.raises((ValueError, OSError), match=message) as refusal:
        read_map(path)
    assert str(tmp_path) in str(refusal.value)
    assert len(str(refusal.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("image: [", "map.yaml is not YAML"),
        ("just words", "map.yaml is not the YAML file of a map"),
        ("", "map.yaml is not the YAML file of a map"),
        (b"\xff\xfe\x00", "map.yaml is not YAML"),
    ],
)
def test_a_file_that_is_no_yaml_is_refused(text, message, tmp_path):
    path = tmp_path / "map.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ValueError, match=message):
        read_map(path)


@pytest.mark.parametrize("mode", ["I;16", "F", "CMYK"])
def test_an_image_of_another_mode_is_refused(mode, tmp_path):
    path = save(tmp_path, GREYS, image="map.tif")
    Image.new(mode, (4, 3)).save(tmp_path / "map.tif")
    with pytest.raises(ValueError, match=rf"map.tif: image mode: {mode} is not allowed: .*8 bits"):
        read_map(path)


def test_a_file_that_is_cut_short_is_refused(tmp_path):
    path = save(tmp_path, np.random.default_rng(0).integers(0, 255, (40, 40)))
    image = tmp_path / "map.png"
    image.write_bytes(image.read_bytes()[:500])
    with pytest.raises(ValueError, match=r"map.png cannot be read as an image"):
        read_map(path)


def test_a_map_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none.yaml: there is no such file"):
        read_map(tmp_path / "none.yaml")
    with pytest.raises(FileNotFoundError, match=r"there is no map in this folder: none of .yaml"):
        map_files(tmp_path)


def test_fields_of_other_programs_are_let_be(tmp_path):
    assert states(tmp_path, [[254]], resolution=FIELDS["resolution"], author="a robot") == [F]


def test_a_drawing_is_written_as_map_saver_does(tmp_path):
    write_map(tmp_path / "map.yaml", GridMap(np.array([[U, F, T]], np.uint8), 0.05))
    assert plain_greys(tmp_path / "map.pgm").tolist() == [[205, 254, 0]]
    assert drawing(read_map(tmp_path / "map.yaml")) == "? . T"
