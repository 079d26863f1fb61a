"""Search methods, a file each: what is trained next, when somebody is asked, and what an answer changes."""
