#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "cells/cell_grid.h"
#include "cells/cell_table.h"
#include "light_cache/cell_rays.h"
#include "rcs/gbuffer.h"
#include "rcs/thread_pool.h"

namespace rcs {

/// A surface for which a cell may be needed.
struct CellFind {
    std::uint64_t cell;  ///< key
    std::uint64_t rank;  ///< of all finds of a cell, those of least rank become its places
    SurfaceSample surface;
};

/// The cells in which lies what rays meet, and places on the surfaces of each.
class CellFinder {
public:
    /// @param most  cells of each add(); beyond, all of them are taken coarser   @param places  of a cell, at the most
    CellFinder(const CellGrid& grid, int most, std::size_t places) : grid_(grid), most_(most), places_of_cell_(places)
    {
    }

    /// Keeps the hits that lie in no cell yet. @param key  of the rays
    void note(std::span<const CellHit> hits, std::uint64_t key, std::vector<CellFind>& finds) const;
    /// Makes the cells of all finds, in the order of their keys.
    void add(std::vector<CellFind> finds);
    /// Cells found from now on are so many levels coarser, and wanted only where none is near.
    void take_coarser(int levels) { coarser_ += levels; }

    const CellGrid& grid() const { return grid_; }
    const std::vector<std::uint64_t>& keys() const { return keys_; }      ///< by cell
    const std::vector<std::uint32_t>& counts() const { return counts_; }  ///< of finds, by cell
    /// At least one. @param cell  its number
    std::span<const SurfaceSample> places(std::size_t cell) const
    {
        return std::span(places_).subspan(first_[cell], first_[cell + 1] - first_[cell]);
    }
    std::size_t size() const { return keys_.size(); }
    std::size_t with_coarser() const { return known_.size(); }  ///< and the cells above them

private:
    void limit(std::vector<CellFind>& finds);
    void add_cell(std::uint64_t cell, std::size_t count);

    CellGrid grid_;
    int most_;
    std::size_t places_of_cell_;
    int coarser_ = 0;
    CellTable known_;  // all cells so far and the coarser ones above them
    std::vector<std::uint64_t> keys_;
    std::vector<std::size_t> first_{0};  // by cell and one more, of its places
    std::vector<SurfaceSample> places_;
    std::vector<std::uint32_t> counts_;
};

/// Rays from points all over the view: which surfaces the hemispheres of visible points meet.
/// @param counted  whose rays are shot, and which keep count of them; one for each thread
void look_around(const GBuffer& gbuffer, std::uint64_t seed, ThreadPool& pool, std::span<CellRays> counted,
                 CellFinder& finder);

}  // namespace rcs
