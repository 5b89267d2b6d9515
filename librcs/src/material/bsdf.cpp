#include "material/bsdf.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "material/ggx.h"
#include "material/ggx_albedo.h"
#include "util/basis.h"

namespace rcs {
namespace {

constexpr float kInversePi = std::numbers::inv_pi_v<float>;

/// A GGX lobe as one viewer sees it.
struct Lobe {
    float alpha, cosine, slant;
    glm::vec3 f0{0.0f};
    float f90 = 0.0f;
    glm::vec3 gain{1.0f};        ///< what multiple scattering adds, and what layers above leave
    float inverse_total = 1.0f;  ///< 1 / E
    glm::vec3 albedo{0.0f};

    Lobe(float width, float cos) : alpha(width), cosine(cos), slant(ggx_slant(cos, width)) {}

    void set_fresnel(glm::vec3 at_normal, float at_grazing)
    {
        f0 = at_normal;
        f90 = at_grazing;
        const GgxAlbedo e = ggx_albedo(cosine, alpha);
        inverse_total = 1.0f / (e.scale + e.bias);
        gain = 1.0f + f0 * (inverse_total - 1.0f);
        albedo = glm::min(gain * (f0 * e.scale + f90 * e.bias), glm::vec3(1.0f));
    }
    glm::vec3 fresnel(float cosine_h) const { return f0 + (f90 - f0) * schlick_weight(cosine_h); }
};

// At exactly grazing view the lobes have no limit in float; a millionth above it they do.
constexpr float kLeastCosine = 1e-6f;

/// All lobes as one viewer sees them, the layers' shares multiplied in.
struct Layers {
    Lobe coat, specular;
    glm::vec3 diffuse, transmission;  ///< directional albedos

    Layers(const Bsdf& b, float cosine_o)
        : coat(b.coat_alpha, std::clamp(cosine_o, kLeastCosine, 1.0f)),
          specular(b.alpha, std::clamp(cosine_o, kLeastCosine, 1.0f)),
          diffuse(b.diffuse),
          transmission(b.transmission)
    {
        if (b.has_specular() || b.transmits()) {
            specular.set_fresnel(b.f0, b.f90);
            diffuse *= 1.0f - specular.albedo;
            transmission *= 1.0f - specular.albedo;
        }
        if (!b.has_coat()) return;
        coat.set_fresnel(glm::vec3(Bsdf::kCoatF0), 1.0f);
        coat.gain *= b.coat;
        coat.albedo *= b.coat;
        const glm::vec3 below = 1.0f - coat.albedo;
        specular.gain *= below;
        specular.albedo *= below;
        diffuse *= below;
        transmission *= below;
    }
};

/// The geometry that every lobe needs of a pair of directions.
struct Pair {
    float cosine_i, cosine_h, sine2_h;
    bool transmitted;  ///< incoming was mirrored to the near side
    bool valid = false;

    Pair(const Bsdf& b, glm::vec3 outgoing, glm::vec3 incoming)
    {
        cosine_i = glm::dot(b.normal, incoming);
        const float above = glm::dot(b.geometric_normal, incoming);
        transmitted = cosine_i < 0.0f;
        if (!(cosine_i * above > 0.0f) || !(glm::dot(b.geometric_normal, outgoing) > 0.0f)) return;
        valid = true;
        if (transmitted) {
            incoming -= 2.0f * cosine_i * b.normal;
            cosine_i = -cosine_i;
        }
        const glm::vec3 sum = outgoing + incoming;
        const float length2 = glm::dot(sum, sum);
        const glm::vec3 cross = glm::cross(b.normal, sum);
        const float inverse2 = 1.0f / std::max(length2, 1e-30f);
        sine2_h = std::min(glm::dot(cross, cross) * inverse2, 1.0f);
        cosine_h = std::clamp(glm::dot(outgoing, sum) * std::sqrt(inverse2), 0.0f, 1.0f);
    }
};

/// D V without Fresnel, and the density of sampling it.
struct LobeValue {
    float value = 0.0f, density = 0.0f;
};
LobeValue lobe_value(const Lobe& lobe, const Pair& pair)
{
    const float d = ggx_distribution(pair.sine2_h, lobe.alpha);
    return {d * ggx_visibility(lobe.cosine, lobe.slant, pair.cosine_i, ggx_slant(pair.cosine_i, lobe.alpha)),
            d * ggx_density_factor(lobe.cosine, lobe.slant)};
}

enum class Which { glossy, all };

/// How often each lobe is sampled.
struct Shares {
    float coat, specular, transmission, diffuse, total;

    Shares(const Layers& l, Which which)
        : coat(mean(l.coat.albedo)),
          specular(mean(l.specular.albedo)),
          transmission(mean(l.transmission)),
          diffuse(which == Which::all ? mean(l.diffuse) : 0.0f),
          total(coat + specular + transmission + diffuse)
    {
    }
    static float mean(glm::vec3 c) { return (c.r + c.g + c.b) * (1.0f / 3.0f); }
};

struct Scattering {
    glm::vec3 value{0.0f};
    float density = 0.0f;
};
Scattering scattering(const Bsdf& b, const Layers& l, const Shares& shares, Which which, glm::vec3 outgoing,
                      glm::vec3 incoming)
{
    Scattering s;
    const Pair pair(b, outgoing, incoming);
    if (!pair.valid) return s;
    const bool viewer_above = glm::dot(b.normal, outgoing) > 0.0f;
    if (pair.transmitted) {
        if (!b.transmits() || !viewer_above) return s;
        const LobeValue lobe = lobe_value(l.specular, pair);
        return {l.transmission * (l.specular.inverse_total * lobe.value),
                shares.transmission * lobe.density / shares.total};
    }
    if (which == Which::all) {
        s.value = l.diffuse * kInversePi;
        s.density = shares.diffuse * pair.cosine_i * kInversePi;
    }
    if (b.has_specular() && viewer_above) {
        const LobeValue lobe = lobe_value(l.specular, pair);
        s.value += l.specular.gain * l.specular.fresnel(pair.cosine_h) * lobe.value;
        s.density += shares.specular * lobe.density;
    }
    if (b.has_coat() && viewer_above) {
        const LobeValue lobe = lobe_value(l.coat, pair);
        s.value += l.coat.gain * l.coat.fresnel(pair.cosine_h) * lobe.value;
        s.density += shares.coat * lobe.density;
    }
    s.density = shares.total > 0.0f ? s.density / shares.total : 0.0f;
    return s;
}

Scattering scattering(const Bsdf& b, Which which, glm::vec3 outgoing, glm::vec3 incoming)
{
    const Layers layers(b, glm::dot(b.normal, outgoing));
    return scattering(b, layers, Shares(layers, which), which, outgoing, incoming);
}

glm::vec3 sample_lobe(const Lobe& lobe, const Bsdf& b, glm::vec3 outgoing, glm::vec2 u)
{
    const Basis basis(b.normal);
    const glm::vec3 h = basis.from_local(sample_visible_normal(basis.to_local(outgoing), lobe.alpha, u));
    return glm::normalize(2.0f * glm::dot(outgoing, h) * h - outgoing);
}

BsdfSample sample(const Bsdf& b, Which which, glm::vec3 outgoing, float choice, glm::vec2 u)
{
    const float cosine_o = glm::dot(b.normal, outgoing);
    const Layers layers(b, cosine_o);
    const Shares shares(layers, which);
    float rest = choice * shares.total;
    BsdfSample result;
    if (!(shares.total > 0.0f)) return result;
    if ((rest -= shares.diffuse) < 0.0f) {
        result.incoming = cosine_direction(b.normal, u);
    } else {
        if (!(cosine_o > 0.0f)) return result;
        const bool by_specular = (rest -= shares.specular) < 0.0f;
        const bool by_coat = !by_specular && (rest -= shares.coat) < 0.0f;
        const Lobe& lobe = by_coat ? layers.coat : layers.specular;
        result.alpha = lobe.alpha;
        result.incoming = sample_lobe(lobe, b, outgoing, u);
        const float cosine_i = glm::dot(result.incoming, b.normal);
        if (!(cosine_i > 0.0f)) return result;
        if (!by_specular && !by_coat) result.incoming -= 2.0f * cosine_i * b.normal;
    }
    const Scattering s = scattering(b, layers, shares, which, outgoing, result.incoming);
    result.density = s.density;
    if (s.density > 0.0f) result.weight = s.value * (std::abs(glm::dot(b.normal, result.incoming)) / s.density);
    return result;
}

}  // namespace

glm::vec3 diffuse_albedo(const Bsdf& bsdf, float cosine) { return Layers(bsdf, cosine).diffuse; }

glm::vec3 specular_albedo(const Bsdf& bsdf, float cosine)
{
    const Layers layers(bsdf, cosine);
    return layers.specular.albedo + layers.coat.albedo;
}

glm::vec3 transmission_albedo(const Bsdf& bsdf, float cosine) { return Layers(bsdf, cosine).transmission; }

glm::vec3 evaluate(const Bsdf& bsdf, glm::vec3 outgoing, glm::vec3 incoming)
{
    return scattering(bsdf, Which::all, outgoing, incoming).value;
}

glm::vec3 evaluate_glossy(const Bsdf& bsdf, glm::vec3 outgoing, glm::vec3 incoming)
{
    return scattering(bsdf, Which::glossy, outgoing, incoming).value;
}

BsdfSample sample_glossy(const Bsdf& bsdf, glm::vec3 outgoing, float choice, glm::vec2 u)
{
    return sample(bsdf, Which::glossy, outgoing, choice, u);
}

float glossy_density(const Bsdf& bsdf, glm::vec3 outgoing, glm::vec3 incoming)
{
    return scattering(bsdf, Which::glossy, outgoing, incoming).density;
}

BsdfSample sample(const Bsdf& bsdf, glm::vec3 outgoing, float choice, glm::vec2 u)
{
    return sample(bsdf, Which::all, outgoing, choice, u);
}

float density(const Bsdf& bsdf, glm::vec3 outgoing, glm::vec3 incoming)
{
    return scattering(bsdf, Which::all, outgoing, incoming).density;
}

}  // namespace rcs
