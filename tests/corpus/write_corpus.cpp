// Writes the corpus as files, valid ones and broken ones, each scene into a folder of its own, and record files without
// their checksum: seeds for tests/fuzz.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "corpus/corpus.h"
#include "records/record_bytes.h"

namespace {

/// Files of no record, of plain ones, and of one with radiance.
void write_record_files(const std::string& folder)
{
    std::filesystem::create_directories(folder);
    rcs::Record plain;
    plain.irradiance = {0.5f, 0.25f, 1.0f};
    plain.harmonic_mean_distance = 2.0f;
    plain.minimum_distance = std::numeric_limits<float>::infinity();
    plain.rays = 128;
    plain.footprint = plain.spacing_radius = 0.01f;
    rcs::Record glossy = plain;
    glossy.position = {0.1f, 0.0f, -0.3f};
    glossy.radiance.assign(108, 0.125f);
    const std::vector<std::vector<rcs::Record>> files{{}, {plain}, {plain, plain, plain}, {glossy}, {plain, glossy}};
    for (std::size_t i = 0; i < files.size(); ++i) {
        std::ofstream file(folder + "/" + std::to_string(i) + ".records", std::ios::binary);
        file << rcs::to_bytes({"0123456789abcdef", "bounces 1, accuracy 0.2"}, files[i]);
        if (!file.flush()) throw std::runtime_error("cannot write to " + folder);
    }
}

}  // namespace

int main(int argc, char** argv)
{
    if (argc != 2) {
        std::fputs("usage: write_corpus FOLDER\n", stderr);
        return 2;
    }
    try {
        int number = 0;
        for (const rcs::test::CorpusFile& file : rcs::test::whole_corpus()) {
            const std::string folder = std::string(argv[1]) + "/seed-" + std::to_string(number++);
            std::filesystem::remove_all(folder);
            rcs::test::write_files(file, folder);
        }
        write_record_files(std::string(argv[1]) + "/records");
        std::printf("%d scenes in %s\n", number, argv[1]);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "write_corpus: %s\n", e.what());
        return 1;
    }
    return 0;
}
