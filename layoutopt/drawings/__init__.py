"""Installation drawings and tables: one sheet model at true scale, rendered to PDF, SVG and DXF."""
