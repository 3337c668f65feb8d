"""Published experiments run again: what the papers print, beside what this toolkit gives."""
