"""Commands of evidence: what models, tables and commands are compared with."""

from fegear.files.keys import register_file
from fegear.files.templates import register_template
from fegear.studies.registry import add_root

register_file("case", "validation.study.cases", "Case")
register_template("case", "validation")

add_root(__name__)
