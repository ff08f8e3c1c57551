# MuJoCo's bindings ship no types; this names them all, unchecked, so that everything else can be checked.
from typing import Any

def __getattr__(name: str) -> Any: ...
