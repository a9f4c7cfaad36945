"""The passes by which Numba compiles a text: without those for what texts have not."""

from numba.core import ir_utils, ssa, transforms
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import IRLegalization, NativeLowering, PreLowerStripPhis
from numba.core.untyped_passes import IRProcessing, ReconstructSSA

from .lowering import TextLower


# lifetimes of variables matter where owners are counted, which asks for them again


@register_pass(mutates_CFG=True, analysis_only=False)
class TextProcessing(IRProcessing):
    """Numba's IRProcessing."""

    _name = "text_processing"

    def run_pass(self, state):
        state.func_ir.blocks = transforms.canonicalize_cfg(state.func_ir.blocks)
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class TextSSA(ReconstructSSA):
    """Numba's ReconstructSSA."""

    _name = "text_ssa"

    def run_pass(self, state):
        ssa.reconstruct_ssa(state.func_ir)
        state.func_ir._definitions = ir_utils.build_definitions(state.func_ir.blocks)
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class TextStripPhis(PreLowerStripPhis):
    """Numba's PreLowerStripPhis."""

    _name = "text_strip_phis"

    def run_pass(self, state):
        state.func_ir = self._strip_phi_nodes(state.func_ir)
        state.func_ir._definitions = ir_utils.build_definitions(state.func_ir.blocks)
        return True


@register_pass(mutates_CFG=False, analysis_only=True)
class TextLegalization(IRLegalization):
    """Where variables end, where it matters."""

    _name = "text_legalization"

    def run_pass(self, state):
        return state.flags.nrt and super().run_pass(state)


@register_pass(mutates_CFG=True, analysis_only=False)
class TextLowering(NativeLowering):
    """Numba's NativeLowering."""

    _name = "text_lowering"

    @property
    def lowering_class(self):
        return TextLower


#: In place of Numba's.
OWN = {"IRProcessing": TextProcessing, "ReconstructSSA": TextSSA,
       "PreLowerStripPhis": TextStripPhis, "IRLegalization": TextLegalization,
       "NativeLowering": TextLowering}
