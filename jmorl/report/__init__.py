"""What people see of a run: its progress while it lasts, its tables, and its plots."""
