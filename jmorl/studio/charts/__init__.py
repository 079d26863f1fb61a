"""What the charts of the studio draw, as options of Apache ECharts: pure functions of the view and the selection."""
