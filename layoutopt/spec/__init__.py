"""Specs: TOML files that say what is asked, read with all faults at once.

Overview
--------
`reading.read_spec` takes a file to a `building.Spec`, whose ``problem()`` is what solvers are asked.
`writing.write_spec` writes the frozen copy that stands alone, `layout_file` one layout beside its spec, and
`template` holds the built-in examples. ``source`` and ``lines`` deal with the text, ``schema`` and
``quantities`` (pydantic) with keys and values, ``site_building``, ``space_building``, ``options`` and ``goals``
with what the values mean together. Files named ``finder_`` are about ``[tracking]`` and ``[docking]``, and
``finders`` holds what these say.
"""
