"""What people see of a run: its front, its tables, its progress while it lasts, and its plots."""
