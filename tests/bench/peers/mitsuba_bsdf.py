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


def anisotropic_table(widths, cosines=65, azimuths=17):
    """The same for a lobe of two widths: at cosines (i / (cosines - 1))^2 and azimuths of the viewer up to a quarter
    turn."""
    radius, azimuth = np.meshgrid((np.arange(400) + 0.5) / 400, 2 * np.pi * (np.arange(256) + 0.5) / 256)
    slope = np.sqrt(radius / (1 - radius))
    x, y = widths[0] * slope * np.cos(azimuth), widths[1] * slope * np.sin(azimuth)
    hz = 1 / np.sqrt(1 + x * x + y * y)
    hx, hy = x * hz, y * hz
    smith = lambda x, y, z: 0.5 * (np.sqrt(1 + ((widths[0] * x) ** 2 + (widths[1] * y) ** 2) / (z * z)) - 1)
    result = np.zeros((cosines, azimuths, 2))
    for i in range(cosines):
        c = max((i / (cosines - 1)) ** 2, 1e-5)
        for j in range(azimuths):
            phi = 0.5 * np.pi * j / (azimuths - 1)
            ox, oy = np.sqrt(1 - c * c) * np.cos(phi), np.sqrt(1 - c * c) * np.sin(phi)
            oh = ox * hx + oy * hy + c * hz
            ix, iy, iz = 2 * oh * hx - ox, 2 * oh * hy - oy, 2 * oh * hz - c
            ok = (oh > 0) & (iz > 0)
            g = 1 / (1 + smith(ox, oy, c) + smith(ix, iy, np.where(ok, iz, 1.0)))
            value = np.where(ok, g * oh / (c * hz), 0.0)
            fresnel = (1 - np.clip(oh, 0, 1)) ** 5
            result[i, j] = np.mean(value * (1 - fresnel)), np.mean(value * fresnel)
    return result


def sheen_lambda(x, alpha, where, exp):
    """The fit of KHR_materials_sheen. @param where, exp  of the arrays that x is of"""
    t = (1 - alpha) ** 2
    lerp = lambda a, b: a + (b - a) * t
    fit = lambda x: (lerp(21.5473, 25.3245) / (1 + lerp(3.82987, 3.32435) * x ** lerp(0.19823, 0.16801))
                     + lerp(-1.97760, -1.27393) * x + lerp(-4.32054, -4.85967))
    return where(x < 0.5, exp(fit(x)), exp(2 * fit(0.5) - fit(where(x < 1, 1 - x, 1e-9))))


def sheen_table(alpha, count=129):
    """Directional albedo of a white sheen lobe at cosines (i / (count - 1))^2, by quadrature over directions."""
    t, azimuth = np.meshgrid((np.arange(1000) + 0.5) / 1000, np.pi * (np.arange(256) + 0.5) / 256)
    ci = t ** 3  # denser near the horizon
    result = np.zeros(count)
    for i in range(count):
        c = max((i / (count - 1)) ** 2, 1e-4)
        across = 2 - c * c - ci * ci + 2 * np.sqrt((1 - c * c) * (1 - ci * ci)) * np.cos(azimuth)
        sine2 = across / (across + (c + ci) ** 2)
        d = (2 + 1 / alpha) * sine2 ** (0.5 / alpha) / (2 * np.pi)
        shadow = 1 + sheen_lambda(np.array(c), alpha, np.where, np.exp) + sheen_lambda(ci, alpha, np.where, np.exp)
        result[i] = np.mean(d / (4 * c * shadow) * 3 * t * t) * 2 * np.pi
    return result


class Bsdf(mi.BSDF):
    """Lambert, on either side, below GGX of one or two widths below sheen, as librcs/src/material defines them, seen
    from either side. What is stretched is so along the cross product of `AXIS` and the normal."""

    AXIS = (0.3, 1.0, 0.2)

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.texture = props["texture"] if "texture" in props else None
        self.color = mi.Color3f(*(props[f"color_{c}"] for c in "rgb"))
        self.metallic = props.get("metallic", 0.0)
        self.specular = props.get("specular", 1.0)
        self.dielectric = mi.Color3f(*(props[f"f0_{c}"] for c in "rgb"))
        self.alpha = min(max(props.get("roughness", 1.0) ** 2, 1e-3), 1.0)
        self.f90 = self.specular * (1 - self.metallic) + self.metallic
        self.stretch = props.get("anisotropy", 0.0) ** 2
        self.widths = (self.alpha + self.stretch * (1 - self.alpha), self.alpha)
        table = anisotropic_table(self.widths) if self.stretch > 0 else albedo_table(self.alpha)
        self.azimuths = table.shape[1] if self.stretch > 0 else 1
        table = table.reshape(-1, 2)
        self.scale, self.bias = mi.Float(table[:, 0]), mi.Float(table[:, 1])
        self.sheen_color = mi.Color3f(*(props.get(f"sheen_{c}", 0.0) for c in "rgb"))
        self.sheen = max(props.get(f"sheen_{c}", 0.0) for c in "rgb")
        self.sheen_alpha = min(max(props.get("sheen_roughness", 0.0), 0.07), 1.0) ** 2
        self.sheen_total = mi.Float(sheen_table(self.sheen_alpha)) if self.sheen > 0 else None
        self.through = props.get("through", 0.0)
        self.through_color = mi.Color3f(*(props.get(f"through_{c}", 1.0) for c in "rgb"))
        flags = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.GlossyReflection
        if self.through > 0:
            flags = flags | mi.BSDFFlags.DiffuseTransmission
        flags = flags | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [flags]
        self.m_flags = flags

    def albedo(self, o):
        """(scale, bias) for a viewer in the frame of `axes`."""
        nodes = (len(self.scale) // self.azimuths, self.azimuths)
        x = dr.sqrt(dr.clip(o.z, 0, 1)) * (nodes[0] - 1)
        i = dr.minimum(mi.UInt32(x), nodes[0] - 2)
        if nodes[1] == 1:
            look_up = lambda t: dr.lerp(dr.gather(mi.Float, t, i), dr.gather(mi.Float, t, i + 1), x - mi.Float(i))
            return look_up(self.scale), look_up(self.bias)
        y = dr.atan2(dr.abs(o.y), dr.abs(o.x)) / (0.5 * dr.pi) * (nodes[1] - 1)
        j = dr.minimum(mi.UInt32(y), nodes[1] - 2)
        at = lambda t, i, j: dr.gather(mi.Float, t, i * nodes[1] + j)
        row = lambda t, i: dr.lerp(at(t, i, j), at(t, i, j + 1), y - mi.Float(j))
        look_up = lambda t: dr.lerp(row(t, i), row(t, i + 1), x - mi.Float(i))
        return look_up(self.scale), look_up(self.bias)

    def sheen_albedo(self, cosine):
        last = len(self.sheen_total) - 1
        x = dr.sqrt(dr.clip(cosine, 0, 1)) * last
        i = dr.minimum(mi.UInt32(x), last - 1)
        return dr.lerp(dr.gather(mi.Float, self.sheen_total, i), dr.gather(mi.Float, self.sheen_total, i + 1),
                       x - mi.Float(i))

    def axes(self, n):
        """Frame whose x runs along the lobe's direction."""
        if self.stretch == 0:
            return mi.Frame3f(n)
        along = dr.cross(mi.Vector3f(*self.AXIS), n)
        along = dr.normalize(along - dr.dot(along, n) * n)
        return mi.Frame3f(along, dr.cross(n, along), n)

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
        color = self.texture.eval(si, active) if self.texture else self.color
        f0 = dr.lerp(dr.minimum(self.dielectric, 1) * self.specular, color, self.metallic)
        cos_o = dr.clip(dr.dot(n, o), 1e-6, 1)
        scale, bias = self.albedo(self.axes(n).to_local(o))
        total = scale + bias
        gain = 1 + f0 * (1 - total) / total
        sheen, left = mi.Color3f(0), mi.Float(1)
        if self.sheen > 0:
            most = self.sheen_albedo(cos_o)
            sheen = self.sheen_color * dr.minimum(most, 1)
            left = 1 - self.sheen * dr.minimum(most, 1)
        specular = gain * (f0 * scale + self.f90 * bias)
        base = (1 - self.metallic) * (1 - specular) * left
        diffuse, behind = color * (1 - self.through) * base, self.through_color * self.through * base
        return o, g, n, cos_o, f0, gain * left, specular * left, diffuse, behind, sheen

    def shares(self, specular, diffuse, behind, sheen):
        """How often each lobe is sampled: sheen as Lambert is."""
        lambert, through, glossy = dr.mean(diffuse + sheen), dr.mean(behind), dr.mean(specular)
        total = lambert + through + glossy
        return lambert / total, through / total, glossy / total

    def lobes(self, si, wo, active):
        """f cos, density."""
        o, g, n, cos_o, f0, gain, specular, diffuse, behind, sheen = self.values(si, active)
        i = si.to_world(wo)
        cos_i = dr.dot(n, i)
        reflects, passes = (cos_i > 0) & (dr.dot(g, i) > 0), (cos_i < 0) & (dr.dot(g, i) < 0)
        axes = self.axes(n)
        h = dr.normalize(o + i)
        local = axes.to_local(h)
        sine2, oh = dr.squared_norm(dr.cross(n, h)), dr.clip(dr.dot(o, h), 0, 1)
        slope2 = dr.square(local.x / self.widths[0]) + dr.square(local.y / self.widths[1])
        d = 1 / (dr.pi * self.widths[0] * self.widths[1] * dr.square(slope2 + 1 - sine2))

        def slant(v):
            v = axes.to_local(v)
            return dr.sqrt(dr.square(self.widths[0] * v.x) + dr.square(self.widths[1] * v.y) + dr.square(v.z))

        v = 0.5 / (cos_i * slant(o) + cos_o * slant(i))
        f = f0 + (self.f90 - f0) * (1 - oh) ** 5
        lambert, through, glossy = self.shares(specular, diffuse, behind, sheen)
        value = (diffuse / dr.pi + gain * f * d * v) * cos_i
        if self.sheen > 0:
            a = self.sheen_alpha
            masking = lambda c: sheen_lambda(dr.clip(c, 1e-6, 1), a, dr.select, dr.exp)
            shadow = 1 + masking(cos_o) + masking(cos_i)
            charlie = (2 + 1 / a) * sine2 ** (0.5 / a) / (2 * dr.pi) / (4 * cos_o * shadow)
            value += self.sheen_color / dr.maximum(self.sheen_albedo(cos_o), 1) * charlie
        density = lambert * cos_i / dr.pi + glossy * d * 0.5 / (cos_o + slant(o))
        value = dr.select(passes, -behind * cos_i / dr.pi, dr.select(reflects, value, 0))
        density = dr.select(passes, -through * cos_i / dr.pi, dr.select(reflects, density, 0))
        return dr.select(active, value, 0), dr.select(active, density, 0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        o, g, n, cos_o, f0, gain, specular, diffuse, behind, sheen = self.values(si, active)
        lambert, through, _ = self.shares(specular, diffuse, behind, sheen)
        axes = self.axes(n)
        wi = axes.to_local(o)
        microfacets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.widths[0], self.widths[1], True)
        m, _ = microfacets.sample(mi.Vector3f(wi.x, wi.y, dr.maximum(wi.z, 1e-6)), sample2)
        glossy = axes.to_world(mi.reflect(wi, m))
        cosine = mi.warp.square_to_cosine_hemisphere(sample2)
        near, far = axes.to_world(cosine), axes.to_world(mi.Vector3f(cosine.x, cosine.y, -cosine.z))
        bs = mi.BSDFSample3f()
        bs.wo = si.to_local(dr.select(sample1 < lambert, near, dr.select(sample1 < lambert + through, far, glossy)))
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
