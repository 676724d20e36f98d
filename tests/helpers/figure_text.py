"""Where a figure's text is, and that no text lies on another."""

from __future__ import annotations

from itertools import combinations

import pytest
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox


def text_boxes(figure: Figure) -> list[tuple[str, Bbox]]:
    """The boxes, in pixels, of every text that is really drawn."""
    drawn: list[Text] = []
    draw = Text.draw

    def record(self: Text, renderer: RendererBase, *arguments: object, **named: object) -> None:
        if self.get_visible() and self.get_text().strip():
            drawn.append(self)
        draw(self, renderer, *arguments, **named)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Text, "draw", record)
        canvas = FigureCanvasAgg(figure)
        figure.draw_without_rendering()  # lays the texts out; pixels are not needed
    unique = list(dict.fromkeys(drawn))
    return [(text.get_text(), text.get_window_extent(canvas.get_renderer())) for text in unique]


def assert_text_apart(figure: Figure) -> None:
    """Fail where a text overlaps another, or leaves the figure."""
    boxes = text_boxes(figure)
    assert len(boxes) > 5
    for (one, box), (other, other_box) in combinations(boxes, 2):
        shared = Bbox.intersection(box, other_box)
        assert shared is None or min(shared.width, shared.height) < 0.5, f"{one!r} overlaps {other!r}"
    whole = figure.bbox
    for text, box in boxes:
        assert box.x0 >= whole.x0 - 1 and box.x1 <= whole.x1 + 1, f"{text!r} leaves the figure"
        assert box.y0 >= whole.y0 - 1 and box.y1 <= whole.y1 + 1, f"{text!r} leaves the figure"
