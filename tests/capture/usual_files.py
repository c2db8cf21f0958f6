"""The files of a capture in the usual formats and with the usual names."""

from __future__ import annotations

from firefly_sample.capture.layout import layout_of
from firefly_sample.encoding.formats import Encoding

named_frame = layout_of(None).parse


def encode_image(output, image):
    return Encoding.of([output]).encode(output, {output: image})


def decode_image(output, content):
    return Encoding.of([output]).decode(output, content)[output]


def file_name(output, index):
    return layout_of(None).path(output, index, Encoding.of([output]).suffix(output))
