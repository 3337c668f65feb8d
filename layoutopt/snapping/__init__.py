"""Patterns that can be built: tags on tile corners, joints, tile centres or chalk lines, and what that changes."""
