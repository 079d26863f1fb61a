"""What is measured: speed, quality and the exact front they are compared with. Run each with `python -m`."""
