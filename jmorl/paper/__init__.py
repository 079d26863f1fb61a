"""The paper's experiments: their plan, the published numbers, claims, figures and the report; in both units."""
