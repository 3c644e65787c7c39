"""Decks as programs and people write them: what they hold, and what each line may change when it is taken away.

First line: number of elements, extent, and groups with the number of their f(aces), n(odes) or v(olume's elements).
Before each bar stands what the line is: nothing: no part of any answer, or one that cannot be missed; "e": one element;
"=A": the groups A alone; "*": what the format makes of the rest. "@name" begins another file.
"""

X = [(x, y, z) for x in (0, 1, 2) for y, z in ((0, 0), (1, 0), (1, 1), (0, 1))]
ONE, TWO = "1,5,6,2,4,8,7,3", "5,9,10,6,8,12,11,7"
MIDDLES = [(0.5, 0, 0), (1, 0.5, 0), (0.5, 1, 0), (0, 0.5, 0), (0.5, 0, 1), (1, 0.5, 1), (0.5, 1, 1), (0, 0.5, 1)]
MIDDLES += [(0, 0, 0.5), (1, 0, 0.5), (1, 1, 0.5), (0, 1, 0.5)]
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
TET = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0.5, 0, 0), (0.5, 0.5, 0), (0, 0.5, 0), (0, 0, 0.5), (0.5, 0, 0.5)]
TET += [(0, 0.5, 0.5)]


def lines(form, places=X, first=1):
    """Return a line for each place, of which none can be missed."""
    return "\n".join("|" + form.format(first + k, *map(float, place)) for k, place in enumerate(places))


IN = "{}, {}, {}, {}"
BLOCK = f"|*NODE\n{lines(IN)}\n|*ELEMENT, TYPE=C3D8\ne|1, {ONE}\ne|2, {TWO}"
BASE = "=Base|*NSET, NSET=Base\n=Base|1,2,3,4"
ABAQUS = {
    "flat": f"""2; 2 1 1; Base 4n; All 2v; Top 2f
|*HEADING
|A block of two bricks, of 20 mm
|*NODE
{lines(IN)}
|*ELEMENT, TYPE=C3D8R
e|1, {ONE}
e|2, {TWO}
=Base|*NSET, NSET=Base
=Base|1, 2, 3
=Base|4
=All|*ELSET, ELSET=All, GENERATE
=All|1, 2, 1
=Top,All|*SURFACE, TYPE=ELEMENT, NAME=Top
=Top|1, S2
=Top|2, S2
|*MATERIAL, NAME=Steel
|*DENSITY
|7.85e-9
|*ELASTIC, TYPE=ISOTROPIC
|210000., 0.3
|*SOLID SECTION, ELSET=All, MATERIAL=Steel
|*STEP, NAME=Push
|*STATIC
|0.1, 1.
|*BOUNDARY
|Base, 1, 3
|*CLOAD
|9, 2, -5.
|*NODE FILE
|U
|*END STEP""",
    "calculix": """2; 1 1 1; Nfix 3n; Nload 4n; Eall 2v
|** written by a mesher, read by ccx
|*node,nset=Nall
|1,0,0,0
|2,1.,0,0
|3,0,1.E0,0
|4,0,0,1
|5,1,1,1
|*element,type=C3D4,elset=Eall
e|10,1,2,3,4
e|11,2,3,4,5
=Nfix,Nload|*nset,nset=Nfix
=Nfix,Nload|1,2,3,
=Nload|*nset,nset=Nload
=Nload|nfix
=Nload|5
|*material,name=AL
|*elastic
|70000.,.33
|*solidsection,elset=Eall,material=AL
|*amplitude,name=A
|0.,0.,1.,1.
|*timepoints,name=T
|.1,.2
|*step,nlgeom
|*dynamic,direct
|1.e-6,1.e-3
|*boundary,amplitude=A
|Nfix,1,3,0.
|*nodefile,frequency=5
|U,RF
|*elfile
|S
|*endstep""",
    "cae": f"""2; 2 1 1; Base 4n; Steel 2v; Top 2f
|*Heading
|** Job name: seat Model name: Model-1
|*Preprint, echo=NO, model=NO, history=NO, contact=NO
|** PARTS
|*Part, name=Seat
|*Node
{lines("      {},           {},           {},           {}")}
|*Element, type=C3D8R
e|1, 1, 5, 6, 2, 4, 8, 7, 3
e|2, 5, 9, 10, 6, 8, 12, 11, 7
=Steel|*Elset, elset=Steel, generate
=Steel| 1,  2,  1
|** Section: Section-1
|*Solid Section, elset=Steel, material=Steel
|,
|*End Part
|*Assembly, name=Assembly
|*Instance, name=Seat-1, part=Seat
|*End Instance
=Base|*Nset, nset=Base, instance=Seat-1
=Base| 1, 2, 3, 4
=Top|*Elset, elset=_Top_S2, internal, instance=Seat-1, generate
=Top| 1,  2,  1
=Top|*Surface, type=ELEMENT, name=Top
=Top|_Top_S2, S2
|*End Assembly
|*Material, name=Steel
|*Density
| 7.85e-09,
|*Elastic
|210000., 0.3
|*Boundary
|Base, ENCASTRE
|*Step, name=Step-1, nlgeom=NO
|*Static
|1., 1., 1e-05, 1.
|*Dsload
|Top, P, 1.
|*Restart, write, frequency=0
|*Output, field, variable=PRESELECT
|*End Step""",
    "placed": f"""4; 2 2 2; Both 8n; Seat-2.Base 4n
|*PART, NAME=Seat
|*NODE
{lines(IN)}
|*ELEMENT, TYPE=C3D8
*|1, {ONE}
*|2, {TWO}
=Seat-1.Base,Seat-2.Base,Both|*NSET, NSET=Base
=Seat-1.Base,Seat-2.Base,Both|1,2,3,4
|*END PART
|*ASSEMBLY, NAME=A
|*INSTANCE, NAME=Seat-1, PART=Seat
*|0., 1., 0.
|*END INSTANCE
|*INSTANCE, NAME=Seat-2, PART=Seat
|1., 0., 1.
*|1., 0., 1., 1., 0., 2., 90.
|*END INSTANCE
=Both|*NSET, NSET=Both
=Both|Seat-1.Base, Seat-2.Base
|*END ASSEMBLY""",
    "parts": f"""3; 3 1 1; Tie 4n; Reed 1v; Struck 1f
|*Part, name=Seat
|*Node
{lines(IN)}
|*Element, type=C3D8I, elset=Seat
e|1, {ONE}
e|2, {TWO}
=Tie,A.End,B.End|*Nset, nset=End
=Tie,A.End|9,10,11,12
|*End Part
|*Part, name=Reed
|*Node
{lines(IN, X[:8])}
|*Element, type=C3D8I, elset=Reed
e|1, {ONE}
=Tie,A.End,B.End|*Nset, nset=End
=Tie,B.End|1,2,3,4
=Struck|*Surface, name=Struck
=Struck|1, S4
|*End Part
|*Assembly, name=Assembly
|*Instance, name=A, part=Seat
|*End Instance
|*Instance, name=B, part=Reed
*|2., 0., 0.
|*End Instance
|*Node
|1, 9., 9., 9.
|*Nset, nset=RP
=RP|1,
=Tie,RP|*Nset, nset=Tie
=Tie|A.End,
=Tie|B.End,
|*Tie, name=Constraint-1, adjust=no
|s_A, s_B
|*End Assembly""",
    "quadratic": f"""1; 1 1 1; Base 8n; Low 1f
|*NODE, NSET=N
{lines(IN, CORNERS + MIDDLES)}
|*ELEMENT, TYPE=C3D20R, ELSET=E
|7, 1,2,3,4,5,6,7,8, 9,10,11,12,13,14,15,
|** nodes 16 to 20 are on another line
|16,17,18,19,20
=Base|*NSET, NSET=Base
=Base|1,2,3,4,9,10,
=Base|11,12
=Low|*SURFACE, NAME=Low
=Low|E, S1""",
    "included": f"""2; 2 1 1; Base 4n; E 2v
|*HEADING
|*INCLUDE, INPUT=mesh/nodes.inp
|*INCLUDE,
|INPUT="mesh/elements.msh"
=Base|*INCLUDE, INPUT=sets.inp
|*STEP
|*STATIC
|*INCLUDE, FILE=loads.txt
|*END STEP
@mesh/nodes.inp
|*NODE
{lines(IN)}
@mesh/elements.msh
|*ELEMENT, TYPE=C3D8, ELSET=E
e|1, {ONE}
e|2, {TWO}
@sets.inp
{BASE}
@loads.txt
|*CLOAD
|9, 1, 1.""",
    "input": f"""2; 2 1 1; Base 4n; E 2v
|*NODE, INPUT=nodes.txt
|*ELEMENT, TYPE=C3D8, INPUT=elements.txt, ELSET=E
=Base|*NSET, NSET=Base, INPUT=base.txt
@nodes.txt
|** x, y, z
{lines(IN)}
@elements.txt
e|1, {ONE}
e|2, {TWO}
@base.txt
=Base|1,2,3,4""",
    "generated": f"""2; 2 1 1; All 12n; Odd 6n; Some 3n; First 1v; Pair 2v
|*NODE, NSET=All
{lines(IN)}
|*ELEMENT, TYPE=C3D8, ELSET=First
e|100, {ONE}
=First,Second|*ELEMENT, TYPE=C3D8, ELSET=Second
e|200, {TWO}
=Odd|*NSET, NSET=Odd, GENERATE
=Odd|1, 11, 2
=Some,Odd|*NSET, NSET=Some, UNSORTED
=Some|3
=Some|1, 2,
=Pair|*ELSET, ELSET=Pair, GEN
=Pair|100, 200, 100""",
    "skins": f"""2; 2 1 1; Skin 2f; Up 2f; Solid 2v
|*NODE
{lines(IN)}
|*ELEMENT, TYPE=C3D8, ELSET=Solid
e|1, {ONE}
e|2, {TWO}
=Skin,Up|*ELEMENT, TYPE=M3D4, ELSET=Skin
=Skin,Up|11, 3,4,8,7
=Skin,Up|12, 7,8,12,11
|*ELEMENT, TYPE=MASS, ELSET=Tip
|13, 9
|*ELEMENT, TYPE=B31, ELSET=Bar
|15, 9, 10
|*MASS, ELSET=Tip
|0.001
|*BEAM SECTION, ELSET=Bar, MATERIAL=Steel, SECTION=CIRC
|0.1
|*MEMBRANE SECTION, ELSET=Skin, MATERIAL=Steel
|1e-9,
=Up|*SURFACE, NAME=Up
=Up|Skin, SPOS""",
    "written": """1; 1 1 1; Base 3n
|*NODE ,
| NSET = Some nodes
|1,	.0,	0.D0,	0
|2,	1.0D+00,	, 0
|3,	0.,	100.E-2, 0.,
|4, 0., 0., +1.
|*ELEMENT,
|TYPE = C3D4 ,
|ELSET = "E 1"
|1, 1, 2, 3, 4,
=Base|* NSET , NSET = Base
=Base| 1 , 2 ,
=Base|,3""",
    "materials": f"""2; 2 1 1; Base 4n
|*PART, NAME=Seat
{BLOCK}
{BASE}
|*END PART
|*ORIENTATION, NAME=O
|1., 0., 0., 0., 1., 0.
|*MATERIAL, NAME=Rubber
|*HYPERELASTIC, N=1, MOONEY-RIVLIN
|0.5, 0.1, 0.
|*MATERIAL, NAME=Metal
|*ELASTIC, TYPE=ENGINEERING CONSTANTS
|1.,1.,1.,.3,.3,.3,1.,1.
|1., 20.
|*EXPANSION, ZERO=20
|1.2e-5
|*USER MATERIAL, CONSTANTS=2
|1., 2.
|*DAMPING, ALPHA=1., BETA=1e-8
|*SURFACE INTERACTION, NAME=I
|*FRICTION
|0.1
|*CONTACT PAIR, INTERACTION=I
|a, b
|*EQUATION
|2
|1, 1, 1., 2, 1, -1.
|*INITIAL CONDITIONS, TYPE=TEMPERATURE
|Base, 20.""",
    "steps": f"""2; 2 1 1; Base 4n; Tip 2n
{BLOCK}
{BASE}
|*STEP, PERTURBATION
|*STEADY STATE DYNAMICS
|1., 2., 3
=Tip|*NSET, NSET=Tip
=Tip|9, 10
=Tip|*A NEW OUTPUT, OF=2030
|1, 2, 3
|*MODEL CHANGE, REMOVE
|2,
|*OUTPUT, HISTORY
|*NODE OUTPUT, NSET=Tip
|U3
|*END STEP""",
    "bodies": f"""2; 2 1 1; Nodal 4n; Whole 10f; Struck 1f
|*NODE
{lines(IN)}
|100, 5., 5., 5.
|*ELEMENT, TYPE=C3D8, ELSET=E
*|1, {ONE}
*|2, {TWO}
=Nodal|*NSET, NSET=Base
=Nodal,Base|1,2,3,4
=Nodal|*SURFACE, TYPE=NODE, NAME=Nodal
=Nodal|Base, 1.
=Whole,Nodal|*SURFACE, NAME=Whole
=Whole|E,
=Struck,Whole|*SURFACE, TYPE=ELEMENT, NAME=Struck
=Struck|1, S6
|*SURFACE, TYPE=CYLINDER, NAME=Tool
|*COUPLING, CONSTRAINT NAME=C, REF NODE=100, SURFACE=Struck
|*KINEMATIC
|*RIGID BODY, REF NODE=100, ELSET=E
|*CONTACT
|*CONTACT INCLUSIONS, ALL EXTERIOR""",
}
GRID, WIDE = "GRID,{},,{},{},{}", "GRID*   {:<16}{:16}{:<16}{:<16}\n|*       {:<16}"
SMALL = "GRID    {:<8}        {:<8}{:<8}{:<8}"
BRICKS = f"{lines(GRID)}\n|CHEXA,1,3,1,5,6,2,4,8\n|,7,3\n|CHEXA,2,3,5,9,10,6,8,12\n|,11,7"


def wide(places=X, first=1):
    """Return nodes in large fields."""
    rows = ((first + k, "", *map(float, place)) for k, place in enumerate(places))
    return "\n".join("|" + WIDE.format(*row) for row in rows)


def small(name, *words):
    """Return an entry in small fields, continued by +."""
    rows = [words[k : k + 8] for k in range(0, len(words), 8)]
    return "\n|".join(f"{name if k == 0 else '+':8}" + "".join(f"{w!s:8}" for w in row) for k, row in enumerate(rows))


NASTRAN = {
    "free": f"""2; 2 1 1; PID 3 2v; SPC 5 4n; PLOAD4 9 1f
|SOL 101
|CEND
|TITLE = two bricks
|SUBCASE 1
|  SPC = 5
|  LOAD = 9
|BEGIN BULK
|$ a comment
{lines(GRID)}
|CHEXA,1,3,1,5,6,2,4,8,+
|+,7,3
|CHEXA,2,3,5,9,10,6,8,12,+
|+,11,7
|PSOLID,3,1
|MAT1,1,210.+9,,.3,7850.
=SPC 5|SPC1,5,123,1,2,3,4
=PLOAD4 9|PLOAD4,9,1,1.+6,,,,3,8
|ENDDATA
|GRID,1,,7.,7.,7.""",
    "large": f"""2; 2 1 1; PID 3 2v; SPC 5 4n
|BEGIN BULK
{wide()}
|CHEXA*  1               3               1               5
|*       6               2               4               8
|*       7               3
|CHEXA*  2               3               5               9
|*       10              6               8               12
|*       11              7
=SPC 5|SPC1*   5               123             1               2
=SPC 5|*       3               4
|ENDDATA""",
    "labelled": f"""1; 1 1 1; PID 2 1v; SPC 4 6n; PLOAD4 9 1f
|$ small fields
|NASTRAN BUFFSIZE=5000
|SOL     103
|CEND
|METHOD = 1
|BEGIN BULK
|PARAM   POST    -1
|EIGRL   1                       10
{lines(SMALL, TET)}
|CTETRA  5       2       1       2       3       4       5       6       +E5
|+E5     7       8       9       10
|PSOLID  2       1
=PLOAD4 9|PLOAD4  9       5       1.                              1       2
=SPC 4|SPC1    4       123     1       3       4       7       8       10      +S1
=SPC 4|+S1     11      THRU    20
|ENDDATA""",
    "quadratic": f"""1; 1 1 1; PID 2 1v; SPC 4 8n
|BEGIN BULK
{lines(GRID, CORNERS + MIDDLES[:4] + MIDDLES[8:] + MIDDLES[4:8])}
|{small("CHEXA", 7, 2, *range(1, 21))}
=SPC 4|SPC1,4,123,1,THRU,4
=SPC 4|SPC1,4,123,9,10,11,12
|ENDDATA""",
    "rectangular": f"""2; 1 2 1; SPC 1 4n
|BEGIN BULK
|CORD2R  7       0       1.      0.      0.      1.      0.      1.
|+       0.      0.      0.
|CORD2R  8       7       0.      0.      0.      0.      0.      1.
|+       0.      1.      0.
{lines("GRID,{},8,{},{},{}")}
|CHEXA,1,3,{ONE[:11]}
|,7,3
|CHEXA,2,3,5,9,10,6,8,12
|,11,7
=SPC 1|SPC1,1,123,1,2,3,4
|ENDDATA""",
    "curved": """2; 2 2 1; PID 1 2v
|BEGIN BULK
|CORD2C,1,,0.,0.,0.,0.,0.,1.
|,1.,0.,0.
|CORD2S,2,0,0.,0.,0.,0.,0.,1.
|,1.,0.,0.
|GRID,1,1,1.,0.,0.
|GRID,2,1,2.,0.,0.
|GRID,3,2,2.,90.,90.
|GRID,4,2,1.,90.,90.
|GRID,5,1,1.,0.,1.
|GRID,6,1,2.,0.,1.
|GRID,7,,0.,2.,1.
|GRID,8,0,0.,1.,1.
|GRID,9,2,0.,0.,0.
|GRID,10,2,1.,0.,0.
|CHEXA,1,1,1,2,3,4,5,6
|,7,8
|CHEXA,2,1,9,1,4,9,10,5
|,8,10
|ENDDATA""",
    "displaced": f"""2; 2 1 1; PID 3 2v
|BEGIN BULK
|CORD1R,9,1,2,3
|GRDSET,,,,,,9,6
{BRICKS}
|ENDDATA""",
    "plain": f"""2; 1 1 1; PID 1 1v; PID 2 1v; SPC 1 3n
{lines("grid	{}		{}	{}	{}", [*TET[:4], (1, 1, 1)])}
e|ctetra	1	1	1	2	3	4
e|ctetra,2,2,2,3,4,5
=SPC 1|spc1,1,123,1,thru,3
|enddata
|anything goes here, 1, 2""",
    "included": f"""2; 2 1 1; PID 3 2v; SPC 5 4n
|SOL 101
|CEND
|INCLUDE 'case.txt'
|BEGIN BULK
|include "mesh/nodes.bdf"
|INCLUDE 'mesh/
|   elements.bdf'
=SPC 5|INCLUDE held.dat
|ENDDATA
@case.txt
|SPC = 5
@mesh/nodes.bdf
{lines(GRID)}
@mesh/elements.bdf
|CHEXA,1,3,1,5,6,2,4,8
|,7,3
|CHEXA,2,3,5,9,10,6,8,12
|,11,7
@held.dat
=SPC 5|SPC1,5,123,1,2,3,4""",
    "held": f"""2; 2 1 1; PID 3 2v; SPC 1 4n; SPC 2 3n; SPC 3 8n
|BEGIN BULK
{BRICKS}
=SPC 1|SPC,1,1,123,0.,2,123,0.
=SPC 1|SPC,1,3,3,,4,3
=SPC 2|SPC1,2,123456,5,6,7
=SPC 3|SPC1,3,1,5,THRU,99
|SPCADD,9,1,2
|SPOINT,500
|MPC,4,1,1,1.,2,1,-1.
|RBE2,50,1,123,2,3
|RBE3,51,,9,123,1.,123,10,11,+
|+,12
|PSOLID,3,1
|MAT1,1,2.1+11,,.3,7850.,1.2-5,20.
|MAT9,2,1.,2.,3.,4.,5.,6.
|,7.,8.
|TABLED1,7,,,,,,,+
|+,0.,0.,1.,1.,ENDT
|DAREA,4,9,1,1.
|FORCE,1,9,0,5.,0.,0.,1.
|TEMP,6,1,20.,2,20.
|EIGR,3,MGIV,0.,1.+5,,10
|ASET1,123,9,10
|CELAS2,32,1.+3,9,1
|DMIG,KAA,0,6,1,0
|PARAM,WTMASS,.00259
|ENDDATA""",
    "shells": f"""2; 2 1 1; PID 3 2v; PID 4 2f; PID 5 1f; SPC 1 4n
|BEGIN BULK
{BRICKS}
=PID 4|CQUAD4,11,4,3,4,8,7,45.
=PID 4|CQUAD4,12,4,7,8,12,11
=PID 5|CQUAD8,13,5,1,2,3,4
=PID 5|,0,0
|PSHELL,4,1,.001
|PCOMP,5,,,,,,,+
|+,1,.1,0.,YES
|CBAR,20,6,9,10,0.,0.,1.
|BAROR,,6,,,1.,0.,0.
|PBARL,6,1,,ROD,,,,+
|+,.1
|CONM2,21,9,,.5
|PLOAD4,7,11,1.,,,,THRU,12
=SPC 1|SPC1,1,123,1,2,3,4
|ENDDATA""",
    "reals": """1; 1 1 1; PID 1 1v
|BEGIN BULK
|GRID    1
|GRID    2               .1+1    0.0     -0.
|GRID    3                       1.D0
|GRID*   4                               0.0             0.00E+00        *G4
|*G4     100.-2
|CTETRA  1       1       1       2       3       4
|ENDDATA""",
    "implicit": f"""2; 2 1 1; PID 3 2v; SPC 5 8n
|$HMNAME COMP 3"block"
|BEGIN BULK
{lines(SMALL)}
|CHEXA          1       3       1       5       6       2       4       8
|               7       3
|CHEXA*,2,3,5,9
|*,10,6,8,12
|*,11,7
=SPC 5|SPC1,5,123,1,2,3,4,5,6,
=SPC 5|,7,8
|PSOLID         3       1
|ENDDATA""",
}
