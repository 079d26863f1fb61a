"""The charts of the studio as options of Apache ECharts: pure functions of the view and the selection."""
