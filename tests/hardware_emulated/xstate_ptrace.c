/* Lets User Mode Linux run on processors whose extended state is larger than its buffer (those with AMX).
 *
 * The kernel takes an extended state only whole, and User Mode Linux 6.1 has room for 2.7 KB of it: its first write of a
 * guest's registers fails, and it ends. Preloaded, this reads the whole state first and replaces what the caller knows;
 * the rest belongs to instructions that the guest, which is not told of them, does not use.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/uio.h>

typedef long (*ptrace_call)(int request, int process, void *address, void *data);

long ptrace(enum __ptrace_request request, ...)
{
    static ptrace_call real;
    static char whole[65536];
    va_list list;

    va_start(list, request);
    int process = va_arg(list, int);
    void *address = va_arg(list, void *);
    void *data = va_arg(list, void *);
    va_end(list);
    if (!real)
        real = (ptrace_call)dlsym(RTLD_NEXT, "ptrace");
    if ((request != PTRACE_GETREGSET && request != PTRACE_SETREGSET) || (long)address != NT_X86_XSTATE)
        return real(request, process, address, data);

    struct iovec *known = data, all = {whole, sizeof whole};
    long result = real(PTRACE_GETREGSET, process, address, &all);
    if (result < 0)
        return result;
    size_t shared = known->iov_len < all.iov_len ? known->iov_len : all.iov_len;
    if (request == PTRACE_GETREGSET) {
        memcpy(known->iov_base, whole, shared);
        known->iov_len = shared;
        return result;
    }
    memcpy(whole, known->iov_base, shared);
    return real(PTRACE_SETREGSET, process, address, &all);
}
