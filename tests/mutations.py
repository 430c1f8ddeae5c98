"""Random changes of descriptions, for tests that each is possible or refused in one sentence."""

import json

from hypothesis import strategies as st

VALUES = st.one_of(
    st.none(), st.booleans(), st.integers(-(10**400), 10**400), st.integers(-5, 5), st.floats(),
    st.text(max_size=5),
    st.lists(st.floats(), max_size=3),
    st.dictionaries(st.text(max_size=5), st.integers(), max_size=2),
    st.sampled_from(["sphere", "sine", "grid", "kind", "csv"]),
)  # fmt: skip

CHANGES = st.sampled_from(["set", "drop", "rename"])


def places(content, place=()):
    """Every place in nested mappings and lists."""
    yield place
    items = (
        content.items()
        if isinstance(content, dict)
        else enumerate(content)
        if isinstance(content, list)
        else ()
    )
    for key, value in items:
        yield from places(value, (*place, key))


def changed(content, place, value, change):
    """Copy of a description with one value set, or one key dropped or renamed."""
    content = json.loads(json.dumps(content))
    holder = content
    for part in place[:-1]:
        holder = holder[part]
    if change == "set" or not isinstance(holder, dict):
        holder[place[-1]] = value
    else:
        kept = holder.pop(place[-1])
        if change == "rename":
            holder[str(value)[:20]] = kept
    return content
