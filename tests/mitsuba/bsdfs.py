"""Furrow's BSDFs as plugins of Mitsuba 3, written from the formulas and not from the renderer's code.

`scene-exact.xml`, written by `trace export --format mitsuba`, uses them:

    import mitsuba as mi
    mi.set_variant("llvm_ad_rgb")        # any vectorised variant
    import bsdfs                         # registers furrow_soil and furrow_leaf
    mi.render(mi.load_file("scene-exact.xml"))

Sources of the formulas: Oren & Nayar 1994; Walter et al. 2007 (GGX) with the height-correlated masking of Heitz 2014;
Fresnel's equations. Directions are sampled by the cosine only: unlike in the renderer, but with the same mean.
"""

import drjit as dr
import mitsuba as mi
import numpy as np

# Smallest cosine to the eye of a shading normal; a normal that turns away further is tilted back to it.
GRAZE = 0.02


def _mean_fresnel(ior):
    """Hemispherical Fresnel reflectance from outside: 2 ∫ F(μ) μ dμ by the midpoint rule."""
    mu = (np.arange(4096) + 0.5) / 4096
    transmitted = np.sqrt(1 - (1 - mu**2) / ior**2)
    s = (mu - ior * transmitted) / (mu + ior * transmitted)
    p = (ior * mu - transmitted) / (ior * mu + transmitted)
    return float(np.mean((s**2 + p**2) * mu))


def _texture(props, name):
    """Returns a texture property by name; a colour becomes a constant texture."""
    value = props[name]
    return value if isinstance(value, mi.Texture) else mi.load_dict({"type": "rgb", "value": list(value)})


class _Coat:
    """A rough dielectric interface seen from outside, and its transmission to the base."""

    def __init__(self, alpha_u, alpha_v, ior):
        self.alpha, self.ior = (alpha_u, alpha_v), ior
        normal = ((ior - 1) / (ior + 1)) ** 2
        self.norm = float(np.sqrt((1 - normal) * (1 - _mean_fresnel(ior))))

    def eval(self, a, b):
        """F D G / (4 cos a), both directions above."""
        m = dr.normalize(a + b)
        surface = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha[0], self.alpha[1])
        shadow = lambda w: dr.rcp(surface.smith_g1(w, m)) - 1
        masking = dr.rcp(1 + shadow(a) + shadow(b))
        value = mi.fresnel(dr.dot(a, m), self.ior)[0] * surface.eval(m) * masking / (4 * a.z)
        return dr.select((a.z > 0) & (b.z > 0) & (m.z > 0), value, 0)

    def through(self, cos):
        return (1 - mi.fresnel(dr.abs(cos), self.ior)[0]) / self.norm


class _SurfaceLayer:
    """A thin layer of white scatterers: single scattering (Chandrasekhar 1960); the half scattered forward counts as transmitted."""

    def __init__(self, depth, scale):
        self.depth, self.scale = depth, scale

    def through(self, si, cos, active):
        return dr.exp(-0.5 * self.scale * self.depth.eval(si, active) / dr.abs(cos))

    def eval(self, si, a, b, active):
        """f |cos θo|."""
        cos_a, cos_b = dr.abs(a.z), dr.abs(b.z)
        gone = 1 - dr.exp(-self.scale * self.depth.eval(si, active) * (dr.rcp(cos_a) + dr.rcp(cos_b)))
        return gone * (cos_b / (4 * dr.pi * (cos_a + cos_b)))


class _Surface(mi.BSDF):
    """A surface with relief; directions whose sides differ between shading and geometric normal scatter nothing."""

    # Whether slopes are added to those over the ground plane, or are relative to the texture's axes.
    OVER_PLANE = False

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.normal = props.get("normal")
        sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        kinds = [mi.BSDFFlags.DiffuseReflection] + ([mi.BSDFFlags.DiffuseTransmission] if self.TRANSMITS else [])
        self.m_components = [kind | sides for kind in kinds]
        self.m_flags = self.m_components[0]
        for kind in self.m_components:
            self.m_flags = self.m_flags | kind

    def local(self, si, active):
        """The shading frame, and the direction to the eye in world and in shading coordinates."""
        eye = si.to_world(si.wi)
        n = si.sh_frame.n
        n = dr.select(dr.dot(n, si.n) < 0, -n, n)
        if self.normal is not None:
            m = 2 * mi.Vector3f(self.normal.eval_3(si, active)) - 1
            slope = (-m.x / m.z, -m.y / m.z)
            if self.OVER_PLANE:
                up = n / dr.maximum(n.z, 0.05)
                n = dr.normalize(mi.Vector3f(up.x - slope[0], up.y - slope[1], up.z))
            else:
                n = dr.normalize(n - slope[0] * dr.normalize(si.dp_du) + slope[1] * dr.normalize(si.dp_dv))
        side = dr.select(dr.dot(si.n, eye) < 0, -1.0, 1.0)
        seen = dr.dot(n, eye)
        n = dr.select(seen * side < GRAZE, dr.normalize(n + eye * (GRAZE * side - seen)), n)
        s = si.dp_du - n * dr.dot(n, si.dp_du)
        frame = mi.Frame3f(n)
        s = dr.select(dr.squared_norm(s) > 1e-16, dr.normalize(s), frame.s)
        frame = mi.Frame3f(s, dr.cross(n, s), n)
        return frame, eye, frame.to_local(eye)

    def evaluate(self, si, wo, active):
        """f |cos θo| and the density of `sample`."""
        frame, eye, a = self.local(si, active)
        light = si.to_world(wo)
        b = frame.to_local(light)
        agree = (dr.dot(si.n, eye) * dr.dot(si.n, light) > 0) == (a.z * b.z > 0)
        lambert = dr.abs(b.z) * dr.inv_pi
        pdf = 0.5 * lambert if self.TRANSMITS else dr.select(a.z * b.z > 0, lambert, 0)
        active = active & agree
        return dr.select(active, self.value(si, a, b, active), 0), dr.select(active, pdf, 0)

    def eval(self, ctx, si, wo, active=True):
        return self.evaluate(si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.evaluate(si, wo, active)[1]

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.evaluate(si, wo, active)

    def sample(self, ctx, si, sample1, sample2, active=True):
        frame, _, a = self.local(si, active)
        b = mi.warp.square_to_cosine_hemisphere(sample2)
        side = dr.select(a.z < 0, -1.0, 1.0)
        if self.TRANSMITS:
            side = dr.select(sample1 < 0.5, side, -side)
        b.z *= side
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = si.to_local(frame.to_world(b))
        value, bs.pdf = self.evaluate(si, bs.wo, active)
        bs.eta = 1.0
        bs.sampled_type = mi.UInt32(+mi.BSDFFlags.DiffuseReflection)
        if self.TRANSMITS:
            through = a.z * b.z < 0
            bs.sampled_type = dr.select(through, +mi.BSDFFlags.DiffuseTransmission, +mi.BSDFFlags.DiffuseReflection)
            bs.sampled_component = dr.select(through, mi.UInt32(1), mi.UInt32(0))
        active = active & (bs.pdf > 0)
        return bs, dr.select(active, value / bs.pdf, 0)

    def to_string(self):
        return type(self).__name__


class Soil(_Surface):
    """Oren & Nayar's rough surface, partly covered by a film of water."""

    TRANSMITS = False
    OVER_PLANE = True

    def __init__(self, props):
        super().__init__(props)
        self.a, self.b, self.scale = props["a"], props["b"], props["scale"]
        self.reflectance = _texture(props, "reflectance")
        self.film = props.get("film")
        if self.film is not None:
            alpha = props["film_alpha"]
            self.coat, self.film_scale = _Coat(alpha, alpha, props["film_ior"]), props["film_scale"]

    def value(self, si, a, b, active):
        flip = dr.select(a.z < 0, -1.0, 1.0)
        above = a.z * b.z > 0
        a, b = mi.Vector3f(a.x, a.y, a.z * flip), mi.Vector3f(b.x, b.y, b.z * flip)
        # cos Δφ sin α tan β with α the larger of the two angles and β the smaller.
        sin_a, sin_b = dr.safe_sqrt(1 - a.z**2), dr.safe_sqrt(1 - b.z**2)
        across = sin_a * sin_b
        cos_phi = dr.select(across > 1e-7, (a.x * b.x + a.y * b.y) / across, 0)
        larger, smaller = dr.maximum(sin_a, sin_b), dr.minimum(sin_a, sin_b)
        shape = self.a + self.b * dr.maximum(cos_phi, 0) * larger * smaller / dr.safe_sqrt(1 - smaller**2)
        value = self.reflectance.eval(si, active) * (self.scale * shape * dr.inv_pi * b.z)
        if self.film is not None:
            film = self.film.eval_1(si, active) * self.film_scale
            let = lambda cos: 1 + film * (self.coat.through(cos) - 1)
            value = value * (let(a.z) * let(b.z)) + film * self.coat.eval(a, b)
        return dr.select(above, value, 0)


class Leaf(_Surface):
    """A sheet with diffuse reflection and transmission; each side has a coat and a layer of trichomes and wax bloom."""

    TRANSMITS = True

    def __init__(self, props):
        super().__init__(props)
        self.sides = []
        for side in ("upper", "lower"):
            coat = None
            if props.has_property(side + "_ior"):
                coat = _Coat(props[side + "_alpha_u"], props[side + "_alpha_v"], props[side + "_ior"])
            layer = None
            if props.has_property(side + "_layer"):
                layer = _SurfaceLayer(_texture(props, side + "_layer"), props[side + "_layer_scale"])
            self.sides.append((coat, layer, _texture(props, side), props[side + "_scale"]))
        self.transmittance, self.scale = _texture(props, "through"), props["through_scale"]

    def value(self, si, a, b, active):
        let = lambda coat, cos: mi.Float(1) if coat is None else coat.through(cos)
        seen = lambda layer, cos: mi.Color3f(1) if layer is None else layer.through(si, cos, active)
        lambert = dr.abs(b.z) * dr.inv_pi
        above = a.z > 0
        values = []
        for (coat, layer, paint, scale), flip in zip(self.sides, (1, -1)):
            value = paint.eval(si, active) * (scale * lambert * let(coat, a.z) * let(coat, b.z))
            if coat is not None:
                value += coat.eval(mi.Vector3f(a.x, a.y, flip * a.z), mi.Vector3f(b.x, b.y, flip * b.z))
            if layer is not None:
                value = value * seen(layer, a.z) * seen(layer, b.z) + layer.eval(si, a, b, active)
            values.append(value)
        through = self.transmittance.eval(si, active) * (
            self.scale * lambert * let(self.sides[0][0], dr.select(above, a.z, b.z)) * let(self.sides[1][0], dr.select(above, b.z, a.z))
        )
        through *= seen(self.sides[0][1], dr.select(above, a.z, b.z)) * seen(self.sides[1][1], dr.select(above, b.z, a.z))
        return dr.select(a.z * b.z > 0, dr.select(above, values[0], values[1]), through)


mi.register_bsdf("furrow_soil", Soil)
mi.register_bsdf("furrow_leaf", Leaf)
