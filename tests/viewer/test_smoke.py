"""The scene smoke in a real window: its keys, and the light that a drag turns."""

import numpy as np

FEW = ("--particles", "300", "--particle-size", "3", "--swing", "0", "--particle-shadow-slices", "8")


def test_keys_change_the_shadows(open_window):
    window = open_window(*FEW, scene="smoke")
    first = window.pause()
    for key in ("h", "h", "i", "a", "b", "c"):
        window.key(key)
        window.changed_from(first)
        first = window.settled()


def test_keys_morph_the_cloud_and_light_it(open_window):
    """Paused at 9 s, when the cloud is a knot by itself: Z takes it back to a heap."""
    window = open_window(*FEW, "--time", "9", scene="smoke")
    pictures = [window.pause()]
    for key in ("z", "2", "1", "l", "y"):
        window.key(key)
        pictures.append(window.changed_from(pictures[-1]))
    knot, heap, between, again, bright, darker = pictures
    assert (knot != heap).any()
    assert (between != heap).any()
    np.testing.assert_array_equal(again, heap)
    assert (bright > heap).any()
    assert (bright >= heap).all()
    assert (darker < bright).any()
    assert (darker <= bright).all()


def test_e_shows_the_slices_in_the_corner(open_window):
    window = open_window(*FEW, scene="smoke")
    window.pause()
    before = window.grab()
    window.key("e")

    def shown():
        now = window.grab()
        changed = (now != before).any(axis=-1)
        return changed[230:350, 10:130].mean() > 0.5 and now[350:358, 2:10].min() > 250

    window.wait_until("slices in the lower left corner", shown)


def test_a_drag_with_the_right_button_turns_the_light_and_not_the_camera(open_window):
    window = open_window(*FEW, scene="smoke")
    before = window.pause()
    window.drag(3, (300, 200), (360, 200), (420, 230))
    turned = window.changed_from(before)
    # the sky, against which the slab's edge is seen, is where it was
    sky = before[..., 2] > before[..., 0].astype(int) + 8
    same = (before == turned).all(axis=-1)
    assert sky.mean() > 0.3
    assert same[sky].mean() > 0.95
    assert same[~sky].mean() < 0.9
    window.key("F1")
    window.changed_from(turned)
    window.drag(2, (300, 200), (330, 210))  # the middle one moves the camera
    window.settled()


def test_a_key_that_makes_the_scene_impossible_is_taken_back(open_window):
    """A blur for which a tile has no room: the window says so, and goes on as before."""
    window = open_window(*FEW, "--particle-shadow-tile", "64", "--shadow-blur", "25", scene="smoke")
    bare = window.message()
    before = window.pause()
    window.wait_until("no message", lambda: np.array_equal(window.message(), bare))
    window.key("b")  # 31.75: no room
    window.wait_until("the message", lambda: not np.array_equal(window.message(), bare))
    np.testing.assert_array_equal(window.settled(), before)
    window.key("d")  # and it goes on
    window.changed_from(before)
    window.wait_until("no message", lambda: np.array_equal(window.message(), bare))
    window.key("Escape")
    assert window.finish() == (0, "")
