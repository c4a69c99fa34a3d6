"""The page of all reasons, and the words that the browser's page makes sentences of, both made from the codes."""

from __future__ import annotations

import json

from app.domain.reason import ReasonCode

_HEAD = """# Reasons

<!-- Generated from app/domain/reason.py; `python -m tests.unit.domain.regenerate` writes it anew. -->

Why a run, a drop, a job or a queue is as it is comes as a code with parameters, and with the reason behind it where
there is one:

```json
{"code": "drop.item_not_reached", "params": {},
 "cause": {"code": "run.not_heard", "params": {"silent_s": 60.2}, "cause": null}}
```

`null` stands for no reason. Codes are stable: decide by them. The words may change: the page, the command line and the
proof of delivery make a sentence of them, `{name}` is the parameter of that name and `{cause}` the reason behind. An
`error` is the code of an error of the API in the parameter `error`, with what it said in `detail`. New codes may come
in any release: show what you do not know as it is.

| code | words |
|---|---|
"""


def reasons_page() -> str:
    """Markdown: one line a code."""
    return _HEAD + "".join(f"| `{code.value}` | {code.words} |\n" for code in ReasonCode)


def reason_words() -> str:
    """JSON: the words of each code."""
    return json.dumps({code.value: code.words for code in ReasonCode}, indent=2) + "\n"
