"""The passes by which texts become instructions: Numba's, without what texts have not.

Numba finds after each of its passes where variables end. That matters where owners of arrays are
counted, and there it is found before the last one.
"""

from numba.core import compiler, ir_utils, ssa, transforms
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import IRLegalization, NativeLowering, PreLowerStripPhis
from numba.core.untyped_passes import IRProcessing, ReconstructSSA

from .lowering import TextLower


@register_pass(mutates_CFG=True, analysis_only=False)
class TextProcessing(IRProcessing):
    """Blocks in order."""

    _name = "text_processing"

    def run_pass(self, state):
        state.func_ir.blocks = transforms.canonicalize_cfg(state.func_ir.blocks)
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class TextSSA(ReconstructSSA):
    """A name for each value that a variable is given."""

    _name = "text_ssa"

    def run_pass(self, state):
        ssa.reconstruct_ssa(state.func_ir)
        return _defined(state)


@register_pass(mutates_CFG=True, analysis_only=False)
class TextStripPhis(PreLowerStripPhis):
    """Where such names meet, assignments."""

    _name = "text_strip_phis"

    def run_pass(self, state):
        state.func_ir = self._strip_phi_nodes(state.func_ir)
        return _defined(state)


@register_pass(mutates_CFG=False, analysis_only=True)
class TextLegalization(IRLegalization):
    """Where variables end, if owners are counted."""

    _name = "text_legalization"

    def run_pass(self, state):
        return state.flags.counts and super().run_pass(state)


@register_pass(mutates_CFG=True, analysis_only=False)
class TextLowering(NativeLowering):
    """Instructions, for owners that are counted where they have to be."""

    _name = "text_lowering"

    def run_pass(self, state):
        state.targetctx = state.targetctx.subtarget(enable_nrt=state.flags.counts)
        return super().run_pass(state)

    @property
    def lowering_class(self):
        return TextLower


def _defined(state):
    state.func_ir._definitions = ir_utils.build_definitions(state.func_ir.blocks)
    return True


#: In place of Numba's.
_OWN = {"IRProcessing": TextProcessing, "ReconstructSSA": TextSSA,
        "PreLowerStripPhis": TextStripPhis, "IRLegalization": TextLegalization,
        "NativeLowering": TextLowering}
#: For what texts have not: closures, contexts, lists of literals, arithmetic of whole arrays; and
#: for what nobody reads.
_LEFT_OUT = {"WithLifting", "InlineClosureLikes", "RewriteDynamicRaises", "InlineInlinables",
             "MakeFunctionToJitFunction", "FindLiterallyCalls", "LiteralUnroll", "InlineOverloads",
             "LiteralPropagationSubPipelinePass", "DeadBranchPrune", "RewriteSemanticConstants",
             "NopythonRewrites", "NoPythonSupportedFeatureValidation", "AnnotateTypes",
             "DumpParforDiagnostics"}


class TextCompiler(compiler.CompilerBase):
    """Numba's, with fewer passes."""

    def define_pipelines(self):
        whole = compiler.DefaultPassBuilder.define_nopython_pipeline(self.state)
        some = PassManager("text")
        some.passes.extend((_OWN.get(kind.__name__, kind), what) for kind, what in whole.passes
                           if kind.__name__ not in _LEFT_OUT)
        some.finalize()
        return [some]
