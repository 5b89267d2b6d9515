// Version 2 of the wire is frozen: these bytes were written by it, and are read and written so for ever. When one of
// these tests fails, the change needs a new protocol version.

#include <gtest/gtest.h>

#include "rcs/v1/service.pb.h"
#include "wire/framing.h"
#include "wire/sha256.h"

namespace rcs::service {
namespace {

v1::Request submit_request()
{
    v1::Request request;
    request.set_id(42);
    v1::Job& job = *request.mutable_submit()->mutable_job();
    v1::SceneFile& file = *job.mutable_scene()->mutable_files()->add_files();
    file.set_path("room.glb");
    file.mutable_content()->set_sha256(std::string(32, '\x11'));
    file.mutable_content()->set_size(1000);
    job.mutable_scene()->set_label("room");
    job.mutable_environment()->mutable_constant()->set_green(0.5f);
    job.mutable_environment()->set_rotation_degrees(90);
    v1::RenderOptions& options = *job.mutable_options();
    options.set_width(64);
    options.set_height(32);
    options.set_aa(2);
    options.set_bounces(8);
    options.mutable_settings()->set_error_tolerance(0.25f);
    options.set_area_samples(8);
    options.set_splat(v1::SPLAT_METHOD_TILES);
    options.add_without_effects("traced-lobes");
    options.set_seed(3);
    job.mutable_tone_map()->set_exposure(-1.5f);
    v1::Output& output = *job.add_outputs();
    output.set_name("a.exr");
    output.set_pixel_format(v1::PIXEL_FORMAT_FLOAT);
    output.add_layers("depth");
    v1::Frame& frame = *job.add_frames();
    frame.set_number(12);
    frame.set_camera_name("door");
    frame.set_time(0.5);
    v1::Camera& camera = *job.add_frames()->mutable_camera_given();
    camera.set_yfov(0.7);
    camera.set_projection(v1::Camera::PROJECTION_ORTHOGRAPHIC);
    job.set_priority(-4);
    job.set_idempotency_key("night-7");
    (*job.mutable_labels())["shot"] = "sh010";
    job.set_time_limit_seconds(600);
    return request;
}

v1::Response watch_response()
{
    v1::Response response;
    response.set_id(43);
    v1::WatchReply& reply = *response.mutable_watch();
    v1::JobStatus& status = *reply.mutable_status();
    status.set_job(9);
    status.set_state(v1::JOB_STATE_RUNNING);
    status.set_frames(2);
    status.set_frames_completed(1);
    status.set_submitted_ms(1'700'000'000'000);
    status.set_owner("uid:1000");
    status.mutable_error()->set_code(v1::ERROR_CODE_TIME_LIMIT);
    status.mutable_error()->set_message("late");
    v1::Progress& progress = *status.add_running();
    progress.set_frame(13);
    progress.set_stage("records");
    progress.set_stage_fraction(0.5f);
    progress.set_fraction(0.25f);
    progress.set_eta_seconds(3.5);
    progress.set_preview_number(2);
    reply.set_last(true);
    return response;
}

v1::Response fetch_response()
{
    v1::Response response;
    response.set_id(44);
    response.mutable_fetch()->set_data("PNG");
    v1::OutputFile& file = *response.mutable_fetch()->mutable_file();
    file.set_name("a.png");
    file.set_size(3);
    file.set_sha256(std::string(32, '\x22'));
    return response;
}

v1::Request retry_request()
{
    v1::Request request;
    request.set_id(45);
    request.mutable_retry()->set_job(9);
    for (const int frame : {-3, 7, 300}) request.mutable_retry()->add_frames(frame);
    return request;
}

v1::Request pause_request()
{
    v1::Request request;
    request.set_id(46);
    request.mutable_pause()->set_job(9);
    request.mutable_pause()->set_resume(true);
    return request;
}

v1::Request priority_request()
{
    v1::Request request;
    request.set_id(47);
    request.mutable_priority()->set_job(9);
    request.mutable_priority()->set_priority(-5);
    return request;
}

v1::Request held_job_request()
{
    v1::Request request;
    request.set_id(48);
    v1::Job& job = *request.mutable_submit()->mutable_job();
    job.add_after(3);
    job.add_after(300);
    job.set_stop_after(4);
    job.set_deliver("/shots/a");
    return request;
}

v1::Response logs_response()
{
    v1::Response response;
    response.set_id(49);
    response.mutable_logs()->set_text("so\n");
    return response;
}

v1::Response list_response()
{
    v1::Response response;
    response.set_id(50);
    v1::JobStatus& status = *response.mutable_list()->add_jobs();
    status.set_job(9);
    status.set_state(v1::JOB_STATE_PAUSED);
    status.set_frames_cancelled(2);
    status.set_waited_seconds(1.5);
    status.set_busy_seconds(2.5);
    status.set_eta_seconds(3.5);
    status.set_fraction(0.25);
    status.set_error_estimate(0.125);
    status.add_waits_for(8);
    status.set_frames_delivered(1);
    status.set_delivery_error("full");
    return response;
}

struct Golden {
    const char* name;
    std::string bytes;
    const char* expected;
};

const Golden kGolden[] = {
    {"submit", frame(submit_request()),
     "e401082a2adf010adc010a3b1a330a310a08726f6f6d2e676c6212250a2011111111111111111111111111111111111111111111"
     "1111111111111111111110e8072204726f6f6d12100a05150000003f1900000000008056401a2408401020180220084802"
     "6a0c7472616365642d6c6f62657370037a050d0000803ea8010822050d0000c0bf2a100a05612e657872100222"
     "0564657074683211080c1204646f6f7221000000000000e03f320d1a0b100121666666666666e63f38fcffffffffffffffff0142"
     "076e696768742d374a0d0a0473686f7412057368303130510000000000c08240"},
    {"watch", frame(watch_response()),
     "4d082b3a490a450809100232087569643a313030303880d095ffbc31500258017208081c12046c6174657a20080d12077265636f"
     "7264731d0000003f250000803e310000000000000c4050021001"},
    {"fetch", frame(fetch_response()),
     "36082c42320a03504e47122b0a05612e706e6710031a202222222222222222222222222222222222222222222222222222222222"
     "222222"},
    {"retry", frame(retry_request()), "15082d72110809120dfdffffffffffffffff0107ac02"},
    {"pause", frame(pause_request()), "08082e7a0408091001"},
    {"priority", frame(priority_request()), "12082f82010d080910fbffffffffffffffff01"},
    {"held job", frame(held_job_request()), "1708302a130a115a0303ac0260046a082f73686f74732f61"},
    {"logs", frame(logs_response()), "0a08319201050a03736f0a"},
    {"list", frame(list_response()),
     "4d083252490a47080910088001028901000000000000f83f9101000000000000044099010000000000000c40a10100000000"
     "0000d03fa901000000000000c03fb2010108b80101c2010466756c6c"},
};

TEST(WireVersion2, MessagesAreWrittenAsTheseBytes)
{
    for (const Golden& golden : kGolden) EXPECT_EQ(hex(golden.bytes), golden.expected) << golden.name;
}

}  // namespace
}  // namespace rcs::service
