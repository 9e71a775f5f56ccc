"""Changes of Blender's properties."""


def change(holder, name):
    """Values of a property that differ from its own. They are set one after the other, and the old one at the end."""
    kind = holder.bl_rna.properties[name]
    old = getattr(holder, name)
    if kind.type == "ENUM":
        others = [] if kind.is_enum_flag else [item.identifier for item in kind.enum_items if item.identifier != old]
    elif kind.type == "BOOLEAN":
        others = [] if kind.is_array else [not old]
    elif kind.type in ("FLOAT", "INT"):
        if kind.is_array:
            others = [[v * 0.5 + kind.hard_min * 0 + 0.25 for v in old]] if kind.type == "FLOAT" else []
        else:
            step = 0.25 if kind.type == "FLOAT" else 1
            others = [old + step if old + step <= kind.hard_max else old - step]
    else:
        others = []
    old = list(old) if getattr(kind, "is_array", False) else old
    for value in others:
        try:
            setattr(holder, name, value)
        except TypeError:  # an enum item that depends on another property
            continue
        yield value
    setattr(holder, name, old)


def own_properties(holder, base):
    return [one.identifier for one in holder.bl_rna.properties
            if not one.is_readonly and one.identifier not in base.bl_rna.properties]
