.PHONY: install editable test lint format stub cpp

install:  # into the active environment
	pip install ".[all]"

editable:  # sources are compiled again by the import that follows a change; see CONTRIBUTING.md
	pip install --upgrade pip
	pip install --group build
	pip install --no-build-isolation --editable ".[test]"

test:
	pytest

lint:
	.ci/lint

format:
	ruff check --fix .
	ruff format .
	find cpp python tests examples benchmarks -name '*.[ch]pp' -exec clang-format -i {} +

stub:  # _core.pyi, from the installed extension module
	pip install pybind11-stubgen
	python python/make_stub.py

cpp:  # the C++ library, its tests and examples, without Python
	cmake --preset default
	cmake --build --preset default
	ctest --preset default
