"""An interpreter of a TorchScript archive's text for a single value: the observation as a chain.

torch.jit.load runs code of the file on loading, and that code may write files. Here the text is
parsed, as it has Python's grammar, and `forward` is followed statement by statement. Steps that a
chain of layers does not take are refused; methods that `forward` does not call do not matter.
"""

import ast
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from spikeport.networks.loading.chain import CHAIN, BoundedEvaluation, Chain
from spikeport.networks.loading.pickles import Module
from spikeport.networks.loading.refusal import EXPORT
from spikeport.networks.loading.tensors import Tensor
from spikeport.reading.mismatch import MismatchError, first_line

STEPS = 20_000
"""The most statements and expressions that are followed: a hundred layers take a tenth of it."""

ON_LOADING = "__setstate__"
HOOKS = ("__forward_hooks__", "__forward_pre_hooks__")
NAMESPACES = ("__torch__", "torch", "ops", "CONSTANTS")

Text = Callable[[str], str]
"""A function that returns the text of a file of the archive, by its dotted name.

It raises `MismatchError` if there is no such file.
"""


class DottedName(NamedTuple):
    """A dotted name not yet resolved: an operation, a function, a constant of the archive."""

    name: str


class _Returned(NamedTuple):
    value: object


class Program:
    """The functions and classes of an archive, parsed when they are needed."""

    def __init__(self, text: Text) -> None:
        self._text = text
        self._files: dict[str, dict[str, ast.FunctionDef | ast.ClassDef]] = {}
        self._methods: dict[str, dict[str, ast.FunctionDef]] = {}

    def function(self, name: str) -> ast.FunctionDef:
        """Return a function by its dotted name."""
        found = self._definition(name)
        if not isinstance(found, ast.FunctionDef):
            raise MismatchError(f"a function {name}", "a class")
        return found

    def method(self, module: Module, name: str) -> ast.FunctionDef:
        """Return a method of a module's class, which must pass the checks of `check_class`."""
        self.check_class(module)
        methods = self._methods[module.kind]
        if name not in methods:
            raise MismatchError(f"a method {name} of {module.kind}", "none")
        return methods[name]

    def check_class(self, module: Module) -> None:
        """Refuse a module whose class has code that runs on loading, or hooks; once a class."""
        if module.kind in self._methods:
            return
        found = self._definition(module.kind)
        if not isinstance(found, ast.ClassDef):
            raise MismatchError(f"a class {module.kind}", "a function")
        for part in found.body:
            if isinstance(part, ast.FunctionDef) and part.name == ON_LOADING:
                where = f"{ON_LOADING} of {module.kind}"
                raise MismatchError("a module without code for loading", where, cure=EXPORT)
            if isinstance(part, ast.Assign) and _hooks(part):
                raise MismatchError(
                    "a module without hooks", f"hooks of {module.kind}", cure=EXPORT
                )
        self._methods[module.kind] = {
            part.name: part for part in found.body if isinstance(part, ast.FunctionDef)
        }

    def _definition(self, name: str) -> ast.FunctionDef | ast.ClassDef:
        file, _, last = name.rpartition(".")
        if file not in self._files:
            self._files[file] = {
                part.name: part
                for part in _parsed(file, self._text(file))
                if isinstance(part, ast.FunctionDef | ast.ClassDef)
            }
        if last not in self._files[file]:
            raise MismatchError(f"a definition of {name}", "none")
        return self._files[file][last]


def _hooks(part: ast.Assign) -> bool:
    names = [target.id for target in part.targets if isinstance(target, ast.Name)]
    return any(name in HOOKS for name in names) and bool(getattr(part.value, "elts", True))


def _parsed(name: str, text: str) -> list[ast.stmt]:
    try:
        with warnings.catch_warnings(action="ignore"):  # from Python, about the text
            return ast.parse(text).body
    # Python's parser raises the last two for deep nesting.
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise MismatchError(
            f"TorchScript in {name}", f"another text ({first_line(error)})"
        ) from None


class Interpreter:
    """Interpreter that follows functions of a program, with operations on chains and constants.

    A chain never changes. So a text that uses an operand, under any name, after an operation has
    changed it in place is refused.
    """

    def __init__(
        self, program: Program, constants: Sequence[object], evaluation: BoundedEvaluation
    ) -> None:
        self._program, self._evaluation = program, evaluation
        self._constants = constants
        self._changed: list[object] = []
        self._steps = 0

    def forward(self, module: Module) -> object:
        """Return the output of the module's ``forward`` for an observation."""
        function = self._program.method(module, "forward")
        if len(function.args.args) != 2:
            found = f"{len(function.args.args) - 1} inputs"
            raise MismatchError("a module with one input, the observation", found)
        return self._unchanged(self._call(function, [module, Chain()], {}))

    def _call(
        self, function: ast.FunctionDef, values: list[object], named: Mapping[str, object]
    ) -> object:
        """Return a function's return value for these arguments."""
        if not _is_plain(function.args):
            wanted = "functions with plain arguments, passed by position or by name"
            raise MismatchError(wanted, f"{function.name} with others")
        names = [argument.arg for argument in function.args.args]
        defaults = function.args.defaults
        variables = {
            name: self._value(default, {})
            for name, default in zip(names[len(names) - len(defaults) :], defaults, strict=True)
        }
        variables |= dict(zip(names, values, strict=False)) | dict(named)
        if len(values) > len(names) or set(variables) != set(names):
            raise MismatchError(f"{function.name}({', '.join(names)})", "other arguments")
        match self._run(function.body, variables):
            case _Returned(value):
                return value
        return None

    def _run(self, body: Sequence[ast.stmt], variables: dict[str, object]) -> _Returned | None:
        for statement in body:
            self._step()
            match statement:
                case ast.Assign(targets=[ast.Name(name)], value=value):
                    variables[name] = self._value(value, variables)
                case ast.Return(value):
                    return _Returned(None if value is None else self._value(value, variables))
                case ast.Expr(value):
                    self._value(value, variables)
                case ast.If(test, then, otherwise):
                    chosen = then if self._decided(test, variables) else otherwise
                    if returned := self._run(chosen, variables):
                        return returned
                case ast.Pass():
                    pass
                case _:
                    raise _foreign(statement)
        return None

    def _decided(self, test: ast.expr, variables: dict[str, object]) -> bool:
        value = self._value(test, variables)
        # A branch that depends on the observation would make another network for each one.
        if not isinstance(value, bool):
            raise MismatchError(CHAIN, f"an if on a value of type {type(value).__name__}")
        return value

    def _value(self, node: ast.expr, variables: dict[str, object]) -> object:
        self._step()
        match node:
            case ast.Constant(value) if value is None or isinstance(value, int | float | str):
                return value
            case ast.Name(name) if name in variables:
                return variables[name]
            case ast.Name(name) if name in NAMESPACES:
                return DottedName(name)
            case ast.UnaryOp(ast.USub(), operand):
                return self._negative(self._value(operand, variables))
            case ast.Attribute(owner, name):
                return self._attribute(self._value(owner, variables), name)
            case ast.Tuple(parts):
                return tuple(self._value(part, variables) for part in parts)
            case ast.List(parts):
                return [self._value(part, variables) for part in parts]
            case ast.Subscript(owner, ast.Constant(int() as place)):
                return self._item(self._value(owner, variables), place)
            case ast.Call(function, arguments, keywords):
                return self._called(function, arguments, keywords, variables)
        raise _foreign(node)

    def _item(self, owner: object, place: int) -> object:
        if not isinstance(owner, list | tuple) or place >= len(owner):
            raise MismatchError(f"a list with an item {place}", type(owner).__name__)
        return self._stored(owner[place])

    def _negative(self, value: object) -> int | float:
        if not isinstance(value, int | float):
            raise MismatchError("a number after a minus sign", type(value).__name__)
        return -value

    def _attribute(self, owner: object, name: str) -> object:
        match owner:
            case DottedName("CONSTANTS"):
                return self._constant(name)
            case DottedName(start):
                return DottedName(f"{start}.{name}")
            case Module() as module:
                return self._of_module(module, name)
        raise MismatchError("an attribute of a module", f"{name} of {type(owner).__name__}")

    def _of_module(self, module: Module, name: str) -> object:
        # For its checks: in a class with code of its own, attributes may differ from the stored.
        self._program.check_class(module)
        if name not in module.attributes:
            raise MismatchError(f"an attribute {name} of {module.kind}", "none")
        if name == "training":
            return False  # as after `eval`: the policy is used, not trained
        return self._stored(module.attributes[name])

    def _constant(self, name: str) -> object:
        number = name.removeprefix("c")
        # At most six digits: `int` raises ValueError for thousands of digits.
        if not number.isdecimal() or len(number) > 6 or int(number) >= len(self._constants):
            raise MismatchError(f"one of the archive's {len(self._constants)} constants", name)
        return self._stored(self._constants[int(number)])

    def _stored(self, value: object) -> object:
        return self._evaluation.keep(value.array()) if isinstance(value, Tensor) else value

    def _called(
        self,
        function: ast.expr,
        arguments: list[ast.expr],
        keywords: list[ast.keyword],
        variables: dict[str, object],
    ) -> object:
        if isinstance(function, ast.Name) and function.id not in variables:
            return self._built_in(function.id, arguments, variables)
        if isinstance(function, ast.Attribute):
            called = self._method_or_name(function, variables)
        else:
            called = self._value(function, variables)
        values = [self._value(argument, variables) for argument in arguments]
        named = {str(word.arg): self._value(word.value, variables) for word in keywords}
        match called:
            case (Module() as module, str(name)):
                method = self._program.method(module, name)
                return self._call(method, [module, *values], named)
            case DottedName(name) if name.startswith("__torch__."):
                return self._call(self._program.function(name), values, named)
            case DottedName(name):
                return self._operation(name, values, named)
        raise MismatchError(CHAIN, f"a call of {type(called).__name__}")

    def _method_or_name(self, function: ast.Attribute, variables: dict[str, object]) -> object:
        owner = self._value(function.value, variables)
        if isinstance(owner, Module):
            return owner, function.attr
        return self._attribute(owner, function.attr)

    def _built_in(
        self, name: str, arguments: list[ast.expr], variables: dict[str, object]
    ) -> object:
        """Return the value of `getattr` (for names that are not identifiers), or of a type cast."""
        match name, arguments:
            case "getattr", [owner, ast.Constant(str(attribute))]:
                return self._attribute(self._value(owner, variables), attribute)
            case "annotate" | "unchecked_cast", [_, value]:
                return self._value(value, variables)
        raise MismatchError(CHAIN, f"a call of {name}")

    def _operation(
        self, reference: str, values: list[object], named: Mapping[str, object]
    ) -> object:
        """Return the value of an operation; aten's are called `torch.NAME`, others `ops.NAME`."""
        name = reference.removeprefix("torch.").removeprefix("ops.").replace(".", "::")
        kind = f"aten::{name}" if reference.startswith("torch.") else name
        operands = [self._unchanged(value) for value in values]
        # Names of in-place operations end in one underscore, names of Python's operators in two.
        if not kind.endswith("_") or kind.endswith("__"):
            return self._evaluation.apply(kind, *operands, **named)
        if not operands or not isinstance(operands[0], Chain):
            raise MismatchError(CHAIN, f"operation {kind} with operands it does not take")
        made = self._evaluation.apply(kind.removesuffix("_"), *operands, **named)
        # A chain never changes: under other names it is still without this operation.
        if made is not operands[0]:
            self._changed.append(operands[0])
        return made

    def _unchanged(self, value: object) -> object:
        # By identity, since `Chain` has no equality, and several names may have one value.
        if any(value is changed for changed in self._changed):
            raise MismatchError(CHAIN, "a value that is used after it was changed in place")
        return value

    def _step(self) -> None:
        self._steps += 1
        if self._steps > STEPS:
            raise MismatchError(f"a forward of at most {STEPS:,} steps", "more")


def _is_plain(arguments: ast.arguments) -> bool:
    """Return whether all arguments may be passed by position and by name."""
    others = (arguments.posonlyargs, arguments.vararg, arguments.kwonlyargs, arguments.kwarg)
    return not any(others)


def _foreign(node: ast.stmt | ast.expr) -> MismatchError:
    kind = type(node).__name__
    return MismatchError(CHAIN, f"{kind} in line {node.lineno} of its text", cure=EXPORT)
