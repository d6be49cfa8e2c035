"""Compressed parts of robots' recordings, measured before a library unpacks them: it would do so whatever their size.

Chunks of MCAP (https://mcap.dev/spec, "Chunk") and of ROS 1 are bounded one by one, files of ROS 2 that are compressed as a
whole as such. Recordings of ROS 2 in which each message is compressed are refused: there is no measuring them.
"""

import bz2
import io
import os
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

from probdmp.errors import DataFileError
from probdmp.io.ros_library import RECOVER

__all__ = ["LARGEST_CHUNK", "bound_ros1_chunks", "check_compressed_file", "check_mcap_chunks"]

LARGEST_CHUNK = 2**28
"""Bytes, also unpacked; recorders write chunks of some megabytes."""
LARGEST_FILE = 2**33
"""Bytes of a compressed file when it is unpacked."""
PIECE = 2**20
CHUNK = 6
"""Kind of record."""
MAGIC = 8
"""Bytes at the beginning of an MCAP file."""


def check_mcap_chunks(file: BinaryIO, name: str) -> None:
    """Refuse an MCAP file with a chunk that is too large, packed or unpacked, whatever it says of itself.

    Raises
    ------
    DataFileError
        If there is one, or the file has no summary.
    """
    from mcap.reader import SeekingReader

    file.seek(0)
    summary = SeekingReader(file, record_size_limit=LARGEST_CHUNK).get_summary()
    if summary is None or summary.statistics is None:
        raise DataFileError(f"a recording that was closed in {name}", "one without a summary of its messages", RECOVER)
    indexed = [chunk.chunk_start_offset for chunk in summary.chunk_indexes]
    for offset in indexed or _chunk_offsets(file):
        file.seek(offset)
        kind, length = struct.unpack("<BQ", file.read(9))
        if kind != CHUNK or length > LARGEST_CHUNK:
            raise _too_large(name, f"{length} bytes" if kind == CHUNK else "something else")
        _check_chunk(file.read(length), name)
    file.seek(0)


def bound_ros1_chunks(readers: Any, name: str) -> None:
    """Make readers of ROS 1 recordings refuse chunks that unpack to more than the limit.

    Parameters
    ----------
    readers : open `rosbags.rosbag1.Reader` objects; of others nothing is changed.
    """
    from lz4.frame import LZ4FrameDecompressor
    from rosbags.rosbag1.reader import decompressors

    unpackers: dict[Any, Callable[[], Any]] = {
        decompressors["bz2"]: bz2.BZ2Decompressor,
        decompressors["lz4"]: LZ4FrameDecompressor,
    }
    for reader in readers:
        chunks = getattr(reader, "chunks", {})
        for position, chunk in chunks.items():
            if chunk.decompressor in unpackers:
                chunks[position] = chunk._replace(decompressor=_bounded(unpackers[chunk.decompressor], name))


def check_compressed_file(path: Path) -> None:
    """Refuse a file compressed with zstd that unpacks to more than the limit.

    Raises
    ------
    DataFileError
        If it does, or is damaged.
    """
    import zstandard

    with open(path, "rb") as file, zstandard.ZstdDecompressor().stream_reader(file, read_across_frames=True) as unpacked:
        total = 0
        while piece := unpacked.read(PIECE):
            total += len(piece)
            if total > LARGEST_FILE:
                raise DataFileError(f"at most {LARGEST_FILE} bytes unpacked in {os.fspath(path)}", "more")


def _chunk_offsets(file: BinaryIO) -> Iterator[int]:
    """Where the chunks of an MCAP file begin, one record after the other."""
    size, offset = file.seek(0, os.SEEK_END), MAGIC
    while offset + 9 + MAGIC <= size:
        file.seek(offset)
        kind, length = struct.unpack("<BQ", file.read(9))
        if kind == CHUNK:
            yield offset
        offset += 9 + length


def _check_chunk(record: bytes, name: str) -> None:
    unpacked_size, length = struct.unpack_from("<16xQ4xI", record)
    compression = record[32 : 32 + length].decode(errors="replace")
    data = record[40 + length :]
    if unpacked_size > LARGEST_CHUNK:
        raise _too_large(name, f"{unpacked_size} bytes")
    if compression == "zstd":
        import zstandard

        if zstandard.frame_content_size(data) != unpacked_size:
            _measure(zstandard.ZstdDecompressor().stream_reader(io.BytesIO(data), read_across_frames=True), name)
    elif compression == "lz4":
        import lz4.frame

        if lz4.frame.get_frame_info(data)["content_size"] != unpacked_size:
            _measure(lz4.frame.open(io.BytesIO(data)), name)


def _measure(unpacked: Any, name: str) -> None:
    total = 0
    while piece := unpacked.read(PIECE):
        total += len(piece)
        if total > LARGEST_CHUNK:
            raise _too_large(name, "more")


def _bounded(make: Callable[[], Any], name: str) -> Callable[[bytes], bytes]:
    def unpack(data: bytes) -> bytes:
        unpacker = make()
        unpacked: bytes = unpacker.decompress(data, LARGEST_CHUNK)
        if not unpacker.eof:
            raise _too_large(name, "more, or one that is cut off")
        return unpacked

    return unpack


def _too_large(name: str, got: str) -> DataFileError:
    return DataFileError(f"chunks of at most {LARGEST_CHUNK} bytes in {name}", got, "Record with smaller chunks.")
