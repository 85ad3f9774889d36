"""The page of claims: a template, so that report.py is about what it says."""

TEMPLATE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Printed and computed</title>
<style>
body { font: 16px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
table { border-collapse: collapse; width: 100%; font-size: 0.92rem; }
th, td { text-align: left; vertical-align: top; padding: 0.35rem 0.6rem; border-bottom: 1px solid #ddd; }
td.number { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
small { color: #666; }
.reproduced { color: #00704f; }
.assumption { color: #0b5d91; }
.not { color: #a34700; }
.impossible, .failed { color: #a34700; font-weight: 600; }
figure { margin: 1rem 0; display: inline-block; max-width: 32rem; }
img { max-width: 100%; }
</style>
</head>
<body>
<h1>Printed and computed</h1>
<p>Every number that a paper prints beside what this installation computes. A verdict follows from the
two numbers and the tolerance; "impossible" also from a bound that no implementation can pass.</p>
{% for report in reports %}
<h2 id="{{ report.name }}">{{ report.file.paper }}</h2>
<p>{{ report.summary() }} <a href="https://doi.org/{{ report.file.doi }}">doi:{{ report.file.doi }}</a></p>
<table>
<tr><th>claim</th><th>printed</th><th>ours</th><th>deviation</th><th>assumption</th><th>verdict</th></tr>
{% for answer in report.answers %}
<tr id="{{ report.name }}-{{ answer.claim.id }}">
<td>{{ answer.claim.text }}<br><small>{{ answer.claim.where }}</small></td>
<td class="number">{{ printed(answer) }}</td>
<td class="number">{{ ours(answer) }}{% if answer.bound is not none %}<br><small>{{ answer.claim.bound_is }} possible: {{ "%.4g"|format(answer.bound) }}</small>{% endif %}</td>
<td class="number">{{ deviation(answer) }}</td>
<td>{{ answer.claim.assumption }}{{ answer.failure }}</td>
<td class="{{ {"reproduced": "reproduced", "reproduced under assumption": "assumption", "not reproduced": "not"}.get(answer.verdict.value, answer.verdict.value) }}">{{ answer.verdict.value }}</td>
</tr>
{% endfor %}
</table>
{% for figure in figures.get(report.name, []) %}
<figure><img src="{{ figure }}" alt="{{ figure }}"></figure>
{% endfor %}
{% endfor %}
</body>
</html>
"""  # noqa: E501 - a row of a table is a line
