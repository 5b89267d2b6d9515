// Writes the corpus as files, valid ones and broken ones, each scene into a folder of its own: seeds for tests/fuzz.
#include <cstdio>
#include <exception>
#include <filesystem>

#include "corpus/corpus.h"

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
        std::printf("%d scenes in %s\n", number, argv[1]);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "write_corpus: %s\n", e.what());
        return 1;
    }
    return 0;
}
