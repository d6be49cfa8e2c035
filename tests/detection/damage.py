"""States of detectors with one piece taken away, added or replaced."""

JUNK = (
    None,
    True,
    -1,
    10**400,
    float("nan"),
    float("inf"),
    1e300,
    "",
    "junk",
    [],
    [1, "x"],
    {},
    {"junk": 1},
    [None, 1],
    [[]],
    (),
    b"",
)


def places(state, path=()):
    """The path of every piece of a state."""
    yield path
    items = state.items() if isinstance(state, dict) else enumerate(state[:2]) if isinstance(state, list) else ()
    for key, value in items:
        yield from places(value, (*path, key))


def damaged(state, path, change):
    """A copy with one piece taken away or replaced."""
    if not path:
        return change(state)
    copy = dict(state) if isinstance(state, dict) else list(state)
    if len(path) == 1 and change is None:
        del copy[path[0]]
    else:
        copy[path[0]] = damaged(copy[path[0]], path[1:], change)
    return copy


def with_surplus(piece):
    """A piece that is more than it should be."""
    return {**piece, "surplus": 1} if isinstance(piece, dict) else [piece]
