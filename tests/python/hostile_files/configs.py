"""Hostile TOML files for ``--config``."""

from hostile_files.case import single

TEXTS = {
    "nul bytes": ("\0" * 64, "line 1: not TOML"),
    "cut in the middle": ("[registration]\nmax_ang", "line 2: not TOML"),
    "cut in a table": ("[registration", "line 1: not TOML"),
    "json": ('{"registration": {}}', "line 1: not TOML"),
    "key twice": ("[registration]\nmax_angle = 1\nmax_angle = 2\n", "line 3: not TOML"),
    "table twice": ("[registration]\n[registration]\n", "line 2: not TOML"),
    "nested 5000 deep": ("a = " + "[" * 5_000 + "]" * 5_000, "nested"),
    "tables 5000 deep": ("[" + ".".join("a" * 5_000) + "]\n", "line 1: .*nested too deep"),
    "number of 5000 digits": ("seed = " + "9" * 5_000, "not TOML|digits"),
    "unknown key": ("[registration]\nmax_angel = 0.5\n", "registration.max_angel.*did you mean"),
    "unknown table": ("[regstration]\nmax_angle = 0.5\n", "regstration"),
    "group as a number": ("registration = 5\n", "registration is a group"),
    "group as a list": ("[[registration]]\nmax_angle = 0.5\n", "registration is a group"),
    "number as a table": ("[registration.max_angle]\nvalue = 1\n", "registration.max_angle"),
    "number as a text": ("[registration]\nmax_angle = '0.5'\n", "registration.max_angle must be a number"),
    "number true": ("[registration]\nmax_angle = true\n", "registration.max_angle must be a number"),
    "number nan": ("[registration]\nmax_angle = nan\n", "max_angle"),
    "number negative": ("[registration]\nmax_angle = -1.0\n", "max_angle"),
    "number a date": ("[registration]\nmax_angle = 1979-05-27\n", "registration.max_angle must be a number"),
    "number 1e400": ("[registration]\nmax_distance = 1e400\n", "max_distance"),
    "whole number a fraction": ("[registration]\nmax_iterations = 1.5\n", "max_iterations must be a whole"),
    "whole number 2 to the 63": ("[registration]\nmax_iterations = 9223372036854775807\n", "max_iterations"),
    "whole number 2 to the 100": (f"[registration]\nmax_iterations = {2**100}\n", "max_iterations"),
    "preset unknown": ("preset = 'papers'\n", "preset must be"),
    "preset a list": ("preset = ['paper']\n", "preset must be"),
    "noise with unknown parts": ("[depth.noise]\nsigma = 1\n", "depth.noise"),
    "noise of words": ("[depth.noise]\nconstant = 'a'\n", "depth.noise|constant"),
    "a megabyte of lists": ("a = [" + "[]," * 300_000 + "]", "larger than"),
}
BYTES = {
    "utf-16": ("seed = 1".encode("utf-16"), "not text"),
    "latin-1": (b"# gr\xfc\xdf\n", "not text"),
}
CONFIGS = single("config", "config", ".toml", TEXTS | BYTES)
