//! The report of `explain` for people.

use std::fmt::Write as _;

use super::{Class, Report};
use crate::measure::explain::{Costs, Limit, Quality, Spread, Work};

/// Everything.
pub fn table(report: &Report<'_>) -> String {
    let (width, height) = report.size;
    let mut text = format!("{}, {}, {}, {width}x{height}\n", report.scene, report.precision, report.isa);
    if let Some(tree) = &report.tree {
        text.push_str(&quality(tree));
    }
    let Costs { lanes, ns_box, ns_triangle, ns_linear } = report.costs;
    let _infallible = writeln!(
        text,
        "single tests  per lane, in vectors of {lanes} over data in the first cache: box {ns_box:.3} ns, triangle (missed) \
         {ns_triangle:.3} ns, triangle in a tile {ns_linear:.3} ns"
    );
    for class in &report.classes {
        let _infallible = write!(text, "\n{} rays, {}-hit\n", class.rays, class.query);
        class.engines.iter().for_each(|work| text.push_str(&engine(work)));
        text.push_str(&comparison(class));
    }
    text
}

fn quality(q: &Quality) -> String {
    let overlap = q.end_point_overlap.map_or("- (no triangles)".into(), |x| {
        format!("{x:.2} boxes at the end of a ray that are not its own surface's")
    });
    let list = |counts: &[u64]| {
        let shown = counts.iter().enumerate().filter(|(_, n)| **n > 0).map(|(i, n)| format!("{}: {n}", i + 1));
        shown.collect::<Vec<_>>().join("  ")
    };
    format!(
        "tree          {} primitives, {} nodes ({:.1} of 8 children), {} leaves\n\
         SAH cost      {:.2}\n\
         overlap       {overlap}\n\
         leaf sizes    {}\n\
         leaf depths   {}\n",
        q.prims,
        q.nodes,
        q.children_per_node,
        q.leaves,
        q.sah_cost,
        list(&q.leaf_sizes),
        list(&q.leaf_depths),
    )
}

fn engine(work: &Work) -> String {
    let Work { engine, lanes, packets, rays, per_packet: p, mrays_per_s, .. } = work;
    let mut text = format!(
        "\n  {engine}: {rays} live rays in {packets} packets of {lanes}, {mrays_per_s:.2} Mrays/s\n  \
         {:<22} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}  0 to max\n",
        "per packet", "mean", "10 %", "median", "90 %", "99 %", "max"
    );
    let rows: [(&str, &Spread); 8] = [
        ("node visits", &p.nodes),
        ("box tests", &p.boxes),
        ("leaf visits", &p.leaves),
        ("primitive tests", &p.prims),
        ("lanes in nodes, %", &p.node_lanes),
        ("lanes in primitives, %", &p.prim_lanes),
        ("bytes looked at", &p.bytes),
        ("rays part at depth", &p.divergence),
    ];
    // A single ray meets a node's boxes all at once; it counts none.
    for (name, s) in rows.into_iter().filter(|(_, s)| s.max > 0.0) {
        let _infallible = writeln!(
            text,
            "  {name:<22} {:>9.1} {:>9.0} {:>9.0} {:>9.0} {:>9.0} {:>9.0}  {}",
            s.mean,
            s.p10,
            s.median,
            s.p90,
            s.p99,
            s.max,
            s.bars()
        );
    }
    let _infallible = write!(
        text,
        "  per ray: {:.2} node visits, {:.2} leaves, {:.2} primitive tests, {:.0} bytes looked at",
        work.nodes_per_ray, work.leaves_per_ray, work.prims_per_ray, work.bytes_per_ray,
    );
    text.push_str(&match 100.0 * work.boxes_passed {
        0.0 => "\n".to_string(),
        share => format!("; {share:.0} % of the boxes of visited nodes met the packet's bounds and were tested\n"),
    });
    // The mean above is one of packets: those with many visits and few lanes count for as much there as those with one.
    if *lanes > 1 {
        let _infallible = writeln!(
            text,
            "  of all lanes that were paid for, {:.0} % wanted the node visit and {:.0} % the primitive test",
            work.node_lanes, work.prim_lanes
        );
    }
    if let Some(together) = work.together {
        let _infallible = writeln!(text, "  {:.0} % of the packets stay together down to the leaves", 100.0 * together);
    }
    match &work.limit {
        Some(Limit { ns_per_ray, boxes, measured_ns_per_ray, percent }) => {
            let _infallible = writeln!(
                text,
                "  limit: {ns_per_ray:.1} ns per ray for the counted tests alone ({boxes:.1} of them boxes); measured \
                 {measured_ns_per_ray:.1} ns: {percent:.0} % of the limit"
            );
        }
        None if work.rays == 0 => text.push_str("  limit: none, there are no rays\n"),
        None => text.push_str("  limit: not known, there are other primitives than triangles\n"),
    }
    if let Some(s) = &work.shares {
        let _infallible = writeln!(
            text,
            "  time: {:.0} % nodes ({:.1} ns each), {:.0} % primitives ({:.1} ns each), {:.0} % set-up and commit ({:.1} ns \
             per ray); the fit explains {:.0} % of what differs between tiles",
            100.0 * s.nodes,
            s.ns_per_node,
            100.0 * s.prims,
            s.ns_per_prim,
            100.0 * s.rays,
            s.ns_per_ray,
            100.0 * s.explained
        );
    }
    text
}

/// What the fastest does less of than the others.
fn comparison(class: &Class) -> String {
    let Some(best) = class.engines.iter().max_by(|a, b| a.mrays_per_s.total_cmp(&b.mrays_per_s)) else {
        return String::new();
    };
    let mut text = String::new();
    for other in class.engines.iter().filter(|other| other.engine != best.engine) {
        let times = |a: f64, b: f64| if b > 0.0 { format!("{:.2}", a / b) } else { "-".into() };
        let _infallible = writeln!(
            text,
            "\n  {} is {} times as fast as {}, which makes {} times as many node visits and {} times as many primitive tests \
             per ray",
            best.engine,
            times(best.mrays_per_s, other.mrays_per_s),
            other.engine,
            times(other.nodes_per_ray, best.nodes_per_ray),
            times(other.prims_per_ray, best.prims_per_ray),
        );
    }
    text
}
