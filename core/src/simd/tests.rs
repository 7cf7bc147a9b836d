use pulp::Arch;

/// Every instruction set that the running machine has.
pub(crate) fn arches() -> Vec<Arch> {
    let mut all = vec![Arch::Scalar];
    #[cfg(target_arch = "x86_64")]
    {
        match pulp::x86::V3::try_new() {
            Some(v3) => all.push(Arch::V3(v3)),
            None => println!("no AVX2 here: not tested"),
        }
        match pulp::x86::V4::try_new() {
            Some(v4) => all.push(Arch::V4(v4)),
            None => println!("no AVX-512 here: not tested"),
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    all.push(Arch::new());
    all
}
