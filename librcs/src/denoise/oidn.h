#pragma once

#include <memory>
#include <string>
#include <vector>

#include <glm/glm.hpp>

namespace rcs {

/// Open Image Denoise 2, opened at run time: nothing else knows that library.
class Oidn {
public:
    /// Looks in the folder that $RCSPLAT_OIDN names, without that wherever the loader does.
    /// @param threads  that it may use; what it makes does not depend on them
    /// @throws Error unsupported: it is not there, not version 2, or does not run here
    explicit Oidn(int threads);
    ~Oidn();
    Oidn(const Oidn&) = delete;
    Oidn& operator=(const Oidn&) = delete;

    const std::string& library() const { return library_; }  ///< "Open Image Denoise 2.3.0"
    const std::string& device() const { return device_; }    ///< "CPU"

    /// Filters light of any scale, >= 0. @param albedo, normal  of the same pixels, without noise
    /// @throws Error unsupported: what the library says
    std::vector<glm::vec3> filter(int width, int height, const std::vector<glm::vec3>& light,
                                  const std::vector<glm::vec3>& albedo, const std::vector<glm::vec3>& normal) const;

private:
    struct Library;
    std::unique_ptr<Library> open_;
    std::string library_, device_;
};

}  // namespace rcs
