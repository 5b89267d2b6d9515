#pragma once

#include <cstddef>
#include <vector>

#include "rays/packet.h"

namespace rcs {

/// Shadow rays collected one by one and traced in packets; keeps its memory from use to use.
class ShadowBatch {
public:
    void clear() { count_ = 0; }
    std::size_t size() const { return count_; }

    void add(const Ray& ray)
    {
        const std::size_t lane = count_ % RayPacket::kWidth;
        const std::size_t packet = count_ / RayPacket::kWidth;
        if (lane == 0 && packet == packets_.size()) {
            packets_.emplace_back();
            reset(packets_.back());
        }
        set_lane(packets_[packet], lane, ray);
        ++count_;
    }

    /// Calls visit(origin, direction, length) for each ray; before trace().
    template <typename Visit>
    void each_ray(const Visit& visit) const
    {
        for (std::size_t i = 0; i < count_; ++i) {
            const RayPacket& p = packets_[i / RayPacket::kWidth];
            const std::size_t lane = i % RayPacket::kWidth;
            visit(ray_origin(p, static_cast<int>(lane)), ray_direction(p, static_cast<int>(lane)), p.t_max[lane]);
        }
    }

    void trace(const RayScene& rays)
    {
        if (rays.has_transparency()) expect_transmitted();
        for (std::size_t p = 0; p < packets(); ++p) trace(rays, p);
    }

    /// Packet p alone. @param rays  with transparency: after expect_transmitted()
    void trace(const RayScene& rays, std::size_t p)
    {
        if (rays.has_transparency())
            rcs::transmittance(rays, active(p), packets_[p], transmitted(p));
        else
            occluded(rays, active(p), packets_[p]);
    }

    /// For who traces them otherwise, packet by packet, and leaves behind what trace() would.
    std::size_t packets() const { return (count_ + RayPacket::kWidth - 1) / RayPacket::kWidth; }
    RayPacket& packet(std::size_t p) { return packets_[p]; }
    /// Bit i is set where packet p has a ray in lane i.
    std::uint32_t active(std::size_t p) const
    {
        const std::size_t rest = count_ - p * RayPacket::kWidth;
        return (1u << (rest < RayPacket::kWidth ? rest : RayPacket::kWidth)) - 1u;
    }
    /// What arrives over its rays: of scenes where light is not either blocked or free.
    LaneWeights& transmitted(std::size_t p) { return transmitted_[p]; }
    /// Makes room for that.
    void expect_transmitted() { transmitted_.resize(packets_.size()); }

    /// What arrives over ray i of the light sent along it, where it is free: less than 1 only behind surfaces that
    /// let light through; after trace().
    glm::vec3 transmittance(std::size_t i) const
    {
        return transmitted_.empty() ? glm::vec3(1.0f)
                                    : transmitted_[i / RayPacket::kWidth].weight[i % RayPacket::kWidth];
    }

    /// Whether nothing blocks ray i wholly; after trace().
    bool is_free(std::size_t i) const { return !(packets_[i / RayPacket::kWidth].t_max[i % RayPacket::kWidth] < 0.0f); }

private:
    std::vector<RayPacket> packets_;
    std::vector<LaneWeights> transmitted_;  // empty in scenes where light is either blocked or not
    std::size_t count_ = 0;
};

}  // namespace rcs
