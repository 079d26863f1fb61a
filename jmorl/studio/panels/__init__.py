"""The panels of the page, a file each. A panel knows the tab and the charts; it knows no other panel and no page."""
