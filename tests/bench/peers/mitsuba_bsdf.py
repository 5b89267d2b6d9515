"""The surfaces of librcs as a Mitsuba BSDF. Mitsuba has no counterpart to them (its `principled` and `roughconductor`
mask and compensate differently), so Bsdf states ours again, from the formulas: GGX with height-correlated masking,
Schlick, compensation by albedo tables integrated here with numpy."""

import drjit as dr
import mitsuba as mi
import numpy as np


def albedo_table(alpha, count=257):
    """GGX directional albedo split by Schlick's weight, (scale, bias) at cosines (i / (count - 1))^2, by quadrature
    over microfacet slopes."""
    radius, azimuth = np.meshgrid((np.arange(600) + 0.5) / 600, 2 * np.pi * (np.arange(256) + 0.5) / 256)
    slope = alpha * np.sqrt(radius / (1 - radius))  # D cos dh is uniform in `radius`
    cos_h = 1 / np.sqrt(1 + slope * slope)
    hx, hz = slope * cos_h * np.cos(azimuth), cos_h
    smith = lambda c: 0.5 * (np.sqrt(1 + alpha * alpha * (1 / (c * c) - 1)) - 1)
    result = np.zeros((count, 2))
    for i in range(count):
        c = max((i / (count - 1)) ** 2, 1e-5)
        oh = np.sqrt(1 - c * c) * hx + c * hz
        ci = 2 * oh * hz - c
        ok = (oh > 0) & (ci > 0)
        ci_ok = np.where(ok, ci, 1.0)
        g = 1 / (1 + smith(c) + smith(ci_ok))
        value = np.where(ok, g * oh / (c * hz), 0.0)  # D G F / (4 c ci) ci, with dh = di / (4 oh) and D hz dh uniform
        fresnel = (1 - np.clip(oh, 0, 1)) ** 5
        result[i] = np.mean(value * (1 - fresnel)), np.mean(value * fresnel)
    return result


class Bsdf(mi.BSDF):
    """Lambert below GGX, as librcs/src/material/bsdf.h defines them, seen from either side."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.texture = props["texture"] if "texture" in props else None
        self.color = mi.Color3f(*(props[f"color_{c}"] for c in "rgb"))
        self.metallic = props.get("metallic", 0.0)
        self.specular = props.get("specular", 1.0)
        self.dielectric = mi.Color3f(*(props[f"f0_{c}"] for c in "rgb"))
        self.alpha = min(max(props.get("roughness", 1.0) ** 2, 1e-3), 1.0)
        self.f90 = self.specular * (1 - self.metallic) + self.metallic
        table = albedo_table(self.alpha)
        self.scale, self.bias = mi.Float(table[:, 0]), mi.Float(table[:, 1])
        flags = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.GlossyReflection
        flags = flags | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [flags]
        self.m_flags = flags

    def albedo(self, cosine):
        x = dr.sqrt(dr.clip(cosine, 0, 1)) * 256
        i = dr.minimum(mi.UInt32(x), 255)
        look_up = lambda t: dr.lerp(dr.gather(mi.Float, t, i), dr.gather(mi.Float, t, i + 1), x - mi.Float(i))
        return look_up(self.scale), look_up(self.bias)

    def frame(self, si):
        """Shading normal on the viewer's side, bent until the viewer's mirror direction leaves the surface."""
        o = si.to_world(si.wi)
        g = dr.select(dr.dot(si.n, o) < 0, -si.n, si.n)
        n = dr.select(dr.dot(si.n, o) < 0, -si.sh_frame.n, si.sh_frame.n)
        least = dr.minimum(0.01, 0.9 * dr.dot(o, g))
        mirrored = 2 * dr.dot(n, o) * n - o
        elevation = dr.dot(mirrored, g)
        level = dr.normalize(mirrored - elevation * g)
        half = dr.normalize(least * g + dr.sqrt(1 - least * least) * level + o)
        glossy = self.f90 > 0
        return o, g, dr.select(mi.Bool(glossy) & (elevation < least), half, n)

    def values(self, si, active):
        o, g, n = self.frame(si)
        base = self.texture.eval(si, active) if self.texture else self.color
        f0 = dr.lerp(dr.minimum(self.dielectric, 1) * self.specular, base, self.metallic)
        cos_o = dr.clip(dr.dot(n, o), 1e-6, 1)
        scale, bias = self.albedo(cos_o)
        total = scale + bias
        gain = 1 + f0 * (1 - total) / total
        specular = gain * (f0 * scale + self.f90 * bias)
        diffuse = base * (1 - self.metallic) * (1 - specular)
        return o, g, n, cos_o, f0, gain, specular, diffuse

    def lobes(self, si, wo, active):
        """f cos, density."""
        o, g, n, cos_o, f0, gain, specular, diffuse = self.values(si, active)
        i = si.to_world(wo)
        cos_i = dr.dot(n, i)
        valid = active & (cos_i > 0) & (dr.dot(g, i) > 0)
        h = dr.normalize(o + i)
        sine2, oh = dr.squared_norm(dr.cross(n, h)), dr.clip(dr.dot(o, h), 0, 1)
        a2 = self.alpha ** 2
        d = a2 / (dr.pi * dr.square(sine2 + a2 * (1 - sine2)))
        slant = lambda c: dr.sqrt(a2 + (1 - a2) * c * c)
        v = 0.5 / (cos_i * slant(cos_o) + cos_o * slant(cos_i))
        f = f0 + (self.f90 - f0) * (1 - oh) ** 5
        share = dr.mean(diffuse) / (dr.mean(diffuse) + dr.mean(specular))
        value = (diffuse / dr.pi + gain * f * d * v) * cos_i
        density = share * cos_i / dr.pi + (1 - share) * d * 0.5 / (cos_o + slant(cos_o))
        return dr.select(valid, value, 0), dr.select(valid, density, 0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        o, g, n, cos_o, f0, gain, specular, diffuse = self.values(si, active)
        share = dr.mean(diffuse) / (dr.mean(diffuse) + dr.mean(specular))
        frame = mi.Frame3f(n)
        wi = frame.to_local(o)
        microfacets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, True)
        m, _ = microfacets.sample(mi.Vector3f(wi.x, wi.y, dr.maximum(wi.z, 1e-6)), sample2)
        glossy = frame.to_world(mi.reflect(wi, m))
        lambert = frame.to_world(mi.warp.square_to_cosine_hemisphere(sample2))
        bs = mi.BSDFSample3f()
        bs.wo = si.to_local(dr.select(sample1 < share, lambert, glossy))
        bs.eta = 1.0
        bs.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
        bs.sampled_component = mi.UInt32(0)
        value, bs.pdf = self.lobes(si, bs.wo, active)
        return bs, dr.select(bs.pdf > 0, value / bs.pdf, 0)

    def eval(self, ctx, si, wo, active=True):
        return self.lobes(si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.lobes(si, wo, active)[1]

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.lobes(si, wo, active)

    def traverse(self, callback):
        pass

    def to_string(self):
        return f"Bsdf[alpha={self.alpha}]"


mi.register_bsdf("rcs_bsdf", lambda props: Bsdf(props))
