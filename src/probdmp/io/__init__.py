"""Files to values and back: demonstrations in several formats, models in one that can be trusted."""

from probdmp.io.atomic import write_atomically
from probdmp.io.csv import read_csv, write_csv
from probdmp.io.formats import read_demonstrations, write_demonstrations
from probdmp.io.json_document import read_json
from probdmp.io.lerobot import read_lerobot
from probdmp.io.mat import read_mat
from probdmp.io.mcap_reading import read_mcap
from probdmp.io.mcap_writing import write_mcap
from probdmp.io.model_contents import ModelContents
from probdmp.io.model_file import decode_model, encode_model, read_model, write_model
from probdmp.io.npz import read_npz, write_npz
from probdmp.io.parquet import read_parquet, write_parquet
from probdmp.io.parquet_executions import Executions, ParquetExecutions, Span
from probdmp.io.parquet_table import ExecutionTable
from probdmp.io.rosbag import read_rosbag
from probdmp.io.selection import Selection

__all__ = [
    "ExecutionTable",
    "Executions",
    "ModelContents",
    "ParquetExecutions",
    "Selection",
    "Span",
    "decode_model",
    "encode_model",
    "read_csv",
    "read_demonstrations",
    "read_json",
    "read_lerobot",
    "read_mat",
    "read_mcap",
    "read_model",
    "read_npz",
    "read_parquet",
    "read_rosbag",
    "write_atomically",
    "write_csv",
    "write_demonstrations",
    "write_mcap",
    "write_model",
    "write_npz",
    "write_parquet",
]
