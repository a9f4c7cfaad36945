"""Errors, argument checks, quadrature, band matrices, compilation: names for the other folders."""

from .errors import (NO_FACTORS, AncfError, CallError, CallbackError, CheckpointError,
                     CheckpointWarning, ConvergenceError, FileError, InputError, Interrupted,
                     MeshError, MissingExtra, ModelWarning, NameUnknown, NearMisses, PickleError,
                     StabilityWarning, SupportError, SweepWarning, along, ask, ask_array, ask_field,
                     ask_number, explained, is_masked, refuse, refuse_any, require_direction,
                     require_finite, require_finite_scalar, require_flag, require_function,
                     require_increasing, require_index, require_integer, require_kind,
                     require_label, require_like, require_moderate, require_module, require_names,
                     require_not_negative, require_option, require_options, require_path,
                     require_point, require_positive, require_slope, require_text, require_unmasked,
                     retold, sample, shown, warn, warnings_as_errors)
from .types import Array, ArrayLike, Law, Place, Rule, StrPath, TimeFunction
from .immutable import (Immutable, array_cache, cached_property, is_builtin, picklable, read_only,
                        rebuilt)
from .quadrature import gauss, gauss_lobatto, hermite_basis, lagrange, product_rule, tensor
from .linear import angle_of, first_order, step, stress_of, unwrapped
from .archive import output_file
from .band import Band, BandMatrix, Inertia, add_multiple, clear
from .callbacks import (call_custom, call_loaded, call_solver, custom_distance, deferred, handle_of,
                        owner, raise_kept)
from .progress import announced_bar, progress_bar
from .source import (C1, C2, C3, F1, F2, F3, I1, I2, I3, MADE, Packed, apart, constant, everywhere,
                     hints, indices, primitive, room, shaped, somewhere, source, where)
