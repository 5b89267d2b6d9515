#include "seal/call_filter.h"

#include <cerrno>
#include <cstddef>
#include <vector>

#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace rcs::service {
namespace {

#if defined(__x86_64__)
constexpr unsigned kMachine = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr unsigned kMachine = AUDIT_ARCH_AARCH64;
#else
#error "the seal of workers does not know this processor's system calls"
#endif
constexpr unsigned kOtherAbi = 0x40000000;  // x32: the same calls by other numbers

// Numbers that Debian 12's headers do not have yet are the same on all processors (include/uapi/asm-generic/unistd.h).
constexpr unsigned kRefused[] = {
    // network; ends of it that are open go on
    SYS_socket,
    SYS_connect,
    SYS_bind,
    SYS_listen,
    SYS_accept,
    SYS_accept4,
    // programs
    SYS_execve,
    SYS_execveat,
    // other processes
    SYS_ptrace,
    SYS_process_vm_readv,
    SYS_process_vm_writev,
    SYS_kcmp,
    SYS_pidfd_open,
    SYS_pidfd_getfd,
    SYS_pidfd_send_signal,
    SYS_tkill,
    SYS_process_madvise,
    SYS_migrate_pages,
    SYS_move_pages,
    SYS_setpriority,
    SYS_ioprio_set,
    // what stands about files in a way that Landlock does not see
    SYS_fchmodat,
    SYS_fchownat,
    SYS_fchown,
    SYS_setxattr,
    SYS_lsetxattr,
    SYS_fsetxattr,
    SYS_removexattr,
    SYS_lremovexattr,
    SYS_fremovexattr,
    SYS_truncate,
    SYS_open_by_handle_at,
    SYS_name_to_handle_at,
    452 /* fchmodat2 */,
    // namespaces and mounts
    SYS_unshare,
    SYS_setns,
    SYS_mount,
    SYS_umount2,
    SYS_pivot_root,
    SYS_chroot,
    SYS_move_mount,
    SYS_open_tree,
    SYS_fsopen,
    SYS_fsconfig,
    SYS_fsmount,
    SYS_fspick,
    SYS_mount_setattr,
    // corners of the kernel
    SYS_bpf,
    SYS_perf_event_open,
    SYS_io_uring_setup,
    SYS_io_uring_enter,
    SYS_io_uring_register,
    SYS_userfaultfd,
    SYS_keyctl,
    SYS_add_key,
    SYS_request_key,
    SYS_init_module,
    SYS_finit_module,
    SYS_delete_module,
    SYS_kexec_load,
    SYS_reboot,
    SYS_swapon,
    SYS_swapoff,
    SYS_acct,
    SYS_quotactl,
    SYS_syslog,
    SYS_personality,
    SYS_settimeofday,
    SYS_clock_settime,
    SYS_adjtimex,
    SYS_sethostname,
    SYS_setdomainname,
    SYS_fanotify_init,
    SYS_msgget,
    SYS_semget,
    SYS_shmget,
    SYS_mq_open,
#ifdef __x86_64__
    SYS_fork,
    SYS_vfork,
    SYS_chmod,
    SYS_chown,
    SYS_lchown,
    SYS_iopl,
    SYS_ioperm,
    SYS_modify_ldt,
    SYS_uselib,
#endif
};

// Those whose first argument says of which process: this one's number alone.
constexpr unsigned kOfOneself[] = {SYS_kill, SYS_tgkill, SYS_rt_sigqueueinfo, SYS_rt_tgsigqueueinfo};
// The same, or 0, which is oneself as well.
constexpr unsigned kOfOneselfOr0[] = {SYS_prlimit64, SYS_sched_setaffinity, SYS_sched_setscheduler, SYS_sched_setparam,
                                      SYS_sched_setattr};

sock_filter load(std::size_t offset) { return BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<unsigned>(offset)); }
sock_filter answer(unsigned what) { return BPF_STMT(BPF_RET | BPF_K, what); }
/// Skips `otherwise` instructions unless it holds.
sock_filter if_equal(unsigned value, unsigned char otherwise)
{
    return BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, 0, otherwise);
}

constexpr unsigned kRefusal = SECCOMP_RET_ERRNO | EPERM;

std::vector<sock_filter> program()
{
    // Threads have numbers of processes too, which sched_* take: those are for the process's own first thread or 0.
    const auto self = static_cast<unsigned>(::getpid());
    const sock_filter first_argument =
        load(offsetof(seccomp_data, args));  // its low half: both processors are little-endian
    std::vector<sock_filter> p{load(offsetof(seccomp_data, arch)), if_equal(kMachine, 1),
                               BPF_JUMP(BPF_JMP | BPF_JA, 1, 0, 0), answer(SECCOMP_RET_KILL_PROCESS),
                               load(offsetof(seccomp_data, nr))};
    const auto add = [&](std::initializer_list<sock_filter> more) { p.insert(p.end(), more); };
#ifdef __x86_64__
    add({BPF_JUMP(BPF_JMP | BPF_JGE | BPF_K, kOtherAbi, 0, 1), answer(kRefusal)});
#endif
    for (const unsigned call : kRefused) add({if_equal(call, 1), answer(kRefusal)});
    for (const unsigned call : kOfOneself) {
        add({if_equal(call, 4), first_argument, if_equal(self, 1), answer(SECCOMP_RET_ALLOW), answer(kRefusal)});
    }
    for (const unsigned call : kOfOneselfOr0) {
        add({if_equal(call, 6), first_argument, if_equal(self, 1), answer(SECCOMP_RET_ALLOW), if_equal(0, 1),
             answer(SECCOMP_RET_ALLOW), answer(kRefusal)});
    }
    // Threads, no processes. clone3 has its flags where no filter sees them; without it libc takes clone.
    add({if_equal(SYS_clone, 4), first_argument, BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, CLONE_THREAD, 0, 1),
         answer(SECCOMP_RET_ALLOW), answer(kRefusal)});
    add({if_equal(SYS_clone3, 1), answer(SECCOMP_RET_ERRNO | ENOSYS), answer(SECCOMP_RET_ALLOW)});
    return p;
}

}  // namespace

bool has_call_filter()
{
    const unsigned errno_answer = SECCOMP_RET_ERRNO;
    return ::syscall(SYS_seccomp, SECCOMP_GET_ACTION_AVAIL, 0, &errno_answer) == 0;
}

bool filter_calls()
{
    std::vector<sock_filter> instructions = program();
    const sock_fprog filter{static_cast<unsigned short>(instructions.size()), instructions.data()};
    return ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter, 0, 0) == 0;
}

}  // namespace rcs::service
