#include "queue/blob_store.h"

#include <filesystem>

#include <gtest/gtest.h>

#include "support/temporary_folder.h"
#include "wire/errors.h"

namespace rcs::service {
namespace {

const std::shared_ptr<const void> kClient = std::make_shared<int>();
constexpr std::int64_t kNow = 1'000'000;  ///< [ms]

v1::Blob blob_of(const std::string& bytes)
{
    v1::Blob blob;
    blob.set_sha256(sha256(bytes));
    blob.set_size(bytes.size());
    return blob;
}

v1::SceneFiles scene_of(const std::vector<std::pair<std::string, std::string>>& files)
{
    v1::SceneFiles scene;
    for (const auto& [path, bytes] : files) {
        scene.add_files()->set_path(path);
        *scene.mutable_files(scene.files_size() - 1)->mutable_content() = blob_of(bytes);
    }
    return scene;
}

TEST(BlobStore, AFileIsThereOnceAllItsBytesAre)
{
    const test::TemporaryFolder folder;
    BlobStore store(folder.path(), {});
    const std::string bytes = "some bytes of a scene";
    const v1::Blob blob = blob_of(bytes);
    EXPECT_EQ(store.put(blob, "a", 0, bytes.substr(0, 10), kNow, kClient), 10u);
    EXPECT_FALSE(store.has(blob.sha256()));
    EXPECT_EQ(store.put(blob, "a", 0, "elsewhere", kNow, kClient), 10u) << "the wrong offset writes nothing";
    EXPECT_EQ(store.held(blob, "a", kNow), 10u);
    EXPECT_EQ(store.held(blob, "b", kNow), 0u) << "owners do not continue each other's";
    EXPECT_EQ(store.put(blob, "a", 10, bytes.substr(10), kNow, kClient), bytes.size());
    EXPECT_EQ(test::bytes_of(store.path(blob.sha256())), bytes);
    EXPECT_EQ(store.held(blob, "b", kNow), bytes.size());
    EXPECT_EQ(store.put(blob, "b", 0, bytes, kNow, kClient), bytes.size()) << "and is not stored twice";
}

TEST(BlobStore, AnUploadGoesOnInAnotherProcess)
{
    const test::TemporaryFolder folder;
    const std::string bytes(3'000'000, 'q');
    const v1::Blob blob = blob_of(bytes);
    BlobStore(folder.path(), {}).put(blob, "a", 0, bytes.substr(0, 2'000'000), kNow, kClient);
    BlobStore store(folder.path(), {});
    EXPECT_EQ(store.held(blob, "a", kNow), 2'000'000u);
    EXPECT_EQ(store.bytes(), 2'000'000u);
    store.put(blob, "a", 2'000'000, bytes.substr(2'000'000), kNow, kClient);
    EXPECT_TRUE(store.has(blob.sha256()));
}

TEST(BlobStore, AnUploadThatOnlyLacksItsVerificationIsCompleted)
{
    const test::TemporaryFolder folder;
    const v1::Blob right = blob_of("all its bytes"), wrong = blob_of("other bytes, of the same number");
    {
        BlobStore store(folder.path(), {});
        store.put(right, "a", 0, "all", kNow, kClient);
        store.put(wrong, "a", 0, "oth", kNow, kClient);
    }
    for (const auto& entry :
         std::filesystem::directory_iterator(folder / "blobs")) {  // as a server leaves them that ends just then
        test::write_bytes(entry.path(), entry.path().string().find(hex(right.sha256())) != std::string::npos
                                            ? "all its bytes"
                                            : "and bytes that are not the right");
    }
    BlobStore store(folder.path(), {});
    EXPECT_EQ(store.held(right, "a", kNow), right.size());
    EXPECT_TRUE(store.has(right.sha256()));
    EXPECT_EQ(store.held(wrong, "a", kNow), 0u);
    EXPECT_FALSE(store.has(wrong.sha256()));
}

TEST(BlobStore, WrongBytesAreDropped)
{
    const test::TemporaryFolder folder;
    BlobStore store(folder.path(), {});
    const v1::Blob blob = blob_of("right");
    try {
        store.put(blob, "a", 0, "wrong", kNow, kClient);
        FAIL();
    } catch (const ServiceError& e) {
        EXPECT_EQ(e.code(), v1::ERROR_CODE_BAD_FILE);
    }
    EXPECT_EQ(store.held(blob, "a", kNow), 0u);
    EXPECT_EQ(store.bytes(), 0u);
    store.put(blob, "a", 0, "right", kNow, kClient);
    EXPECT_TRUE(store.has(blob.sha256()));
}

TEST(BlobStore, LimitsHold)
{
    const test::TemporaryFolder folder;
    BlobStore store(folder.path(), {.max_file = 10, .max_store = 15, .max_uploads = 2});
    EXPECT_THROW(store.put(blob_of("01234567890"), "a", 0, "0", kNow, kClient), ServiceError);
    v1::Blob lied = blob_of("abc");
    EXPECT_THROW(store.put(lied, "a", 0, "abcd", kNow, kClient), ServiceError) << "more bytes than were announced";
    store.put(blob_of("0123456789"), "a", 0, "0123456789", kNow, kClient);
    EXPECT_THROW(store.put(blob_of("9876543210"), "a", 0, "9876543210", kNow, kClient), ServiceError)
        << "the store is full";
    store.put(blob_of("xy"), "a", 0, "x", kNow, kClient);
    EXPECT_THROW(store.put(blob_of("zw"), "a", 0, "z", kNow, kClient), ServiceError) << "too many at a time";
    v1::Blob short_digest;
    short_digest.set_sha256("123");
    EXPECT_THROW(store.put(short_digest, "a", 0, "", kNow, kClient), ServiceError);
}

TEST(BlobStore, AnUploadThatWasBrokenOffHoldsNoPlaceForLong)
{
    const test::TemporaryFolder folder;
    BlobStore store(folder.path(), {.max_uploads = 2});
    store.put(blob_of("first"), "a", 0, "fi", kNow, kClient);
    store.put(blob_of("second"), "a", 0, "se", kNow + 5000, kClient);
    EXPECT_THROW(store.put(blob_of("third"), "a", 0, "th", kNow + 9999, kClient), ServiceError)
        << "those are under way";
    EXPECT_EQ(store.put(blob_of("third"), "a", 0, "th", kNow + 10'000, kClient), 2u);
    EXPECT_THROW(store.put(blob_of("first"), "a", 2, "rst", kNow + 10'000, kClient), ServiceError);
    EXPECT_EQ(store.put(blob_of("first"), "a", 2, "rst", kNow + 15'000, kClient), 5u) << "goes on where it was";
    EXPECT_TRUE(store.has(sha256("first")));
}

TEST(BlobStore, ScenesAreFoldersOfTheirFiles)
{
    const test::TemporaryFolder folder;
    BlobStore store(folder.path(), {});
    const auto scene = scene_of({{"a.gltf", "main"}, {"tex/wood.png", "wood"}});
    store.put(blob_of("main"), "a", 0, "main", kNow, kClient);
    store.put(blob_of("wood"), "a", 0, "wood", kNow, kClient);
    const std::string key = BlobStore::scene_key(scene);
    const std::string main = store.scene(key, scene, kNow);
    EXPECT_EQ(test::bytes_of(main), "main");
    EXPECT_EQ(test::bytes_of(std::filesystem::path(main).parent_path() / "tex/wood.png"), "wood");
    EXPECT_EQ(store.scene(key, scene, kNow), main);
    EXPECT_NE(BlobStore::scene_key(scene_of({{"b.gltf", "main"}, {"tex/wood.png", "wood"}})), key);
}

TEST(BlobStore, NamesThatLeadOutAreRefused)
{
    for (const char* path : {"../a", "a/../../b", "/etc/passwd", "", "a//b", "a/", ".", "a\\b"}) {
        EXPECT_THROW(check_scene_path(path), ServiceError) << path;
    }
    EXPECT_THROW(check_scene_path(std::string("a\0b", 3)), ServiceError);
    EXPECT_THROW(check_scene_path(std::string(2000, 'a')), ServiceError);
    check_scene_path("a/b..c/.d");
}

TEST(BlobStore, RemovesWhatNobodyNeeds)
{
    const test::TemporaryFolder folder;
    BlobStore store(folder.path(), {});
    for (const char* bytes : {"one", "two"}) store.put(blob_of(bytes), "a", 0, bytes, kNow, kClient);
    store.put(blob_of("three"), "a", 0, "th", kNow, kClient);
    constexpr std::int64_t kFuture = std::int64_t{1} << 60;
    EXPECT_EQ(store.remove_unused(0, 1000, {}, {}), 0u) << "all is young";
    EXPECT_EQ(store.remove_unused(kFuture, 1000, {sha256("one")}, {}), 3u + 2u);
    EXPECT_TRUE(store.has(sha256("one")));
    EXPECT_FALSE(store.has(sha256("two")));
    EXPECT_EQ(store.held(blob_of("three"), "a", kNow), 0u);
    EXPECT_EQ(store.remove_unused(0, 2, {}, {}), 3u) << "too full";
}

TEST(BlobStore, WhoseConnectionHasEndedKeepsNoPlace)
{
    const test::TemporaryFolder folder;
    BlobStore store(folder.path(), {.max_uploads = 1});
    auto client = std::make_shared<int>();
    store.put(blob_of("first"), "a", 0, "fi", kNow, client);
    EXPECT_THROW(store.put(blob_of("second"), "a", 0, "se", kNow, kClient), ServiceError);
    client.reset();
    EXPECT_EQ(store.put(blob_of("second"), "a", 0, "se", kNow, kClient), 2u);
    store.put(blob_of("second"), "a", 2, "cond", kNow, kClient);
    EXPECT_EQ(store.put(blob_of("first"), "a", 2, "rst", kNow, kClient), 5u) << "and goes on where it was";
}

}  // namespace
}  // namespace rcs::service
